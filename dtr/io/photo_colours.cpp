#include "dtr/io/photo_colours.h"

#include <fmt/format.h>
#include <lcms2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/io/colour_coding.h"
#include "dtr/io/file_colours.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr double kSamePrimaries = 2e-3;  // of chromaticities, which programs round
constexpr int kSameLevels = 2;           // of 255: a profile of sRGB itself, in some version
constexpr int kGridSteps = 9;            // along each channel, to compare a profile with sRGB

struct ProfileCloser {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct TransformDeleter {
  void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
using Profile = std::unique_ptr<void, ProfileCloser>;
using Transform = std::unique_ptr<void, TransformDeleter>;

bool AreSrgbs(const Primaries& primaries) {
  const Primaries srgb;
  const auto same = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (a - b).cwiseAbs().maxCoeff() < kSamePrimaries;
  };
  return same(primaries.red, srgb.red) && same(primaries.green, srgb.green) &&
         same(primaries.blue, srgb.blue) && same(primaries.white, srgb.white);
}

// OpenEXR's attribute: x and y of red, green, blue and white.
std::optional<ColourCoding> CodingOfChromaticities(const ImageFacts& facts) {
  const std::vector<float> v = facts.Floats("chromaticities");
  if (v.size() != 8) return {};
  ColourCoding coding;
  coding.transfer = Transfer::kLinear;
  coding.primaries = {{v[0], v[1]}, {v[2], v[3]}, {v[4], v[5]}, {v[6], v[7]}};
  return coding;
}

// Cameras set to Adobe RGB write no profile but this (DCF 2.0, "optional colour space").
bool IsAdobeRgbByExif(const ImageFacts& facts) {
  constexpr int kAdobe = 2, kUncalibrated = 65535;
  const int space = facts.Int("Exif:ColorSpace", 1);
  if (space == kAdobe) return true;
  return space == kUncalibrated && facts.Text("Exif:InteroperabilityIndex").starts_with("R03");
}

ColourCoding AdobeRgb() {
  ColourCoding coding;
  coding.transfer = Transfer::kGamma;
  coding.gamma = 563.0 / 256;
  coding.primaries.green = {0.21, 0.71};
  return coding;
}

std::string NamesOf(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

// A value of 0 to 1 as a whole number of so many bits.
template <typename T>
T NumberOf(float value) {
  constexpr auto kMax = static_cast<float>(std::numeric_limits<T>::max());
  return static_cast<T>(std::clamp(value, 0.0F, 1.0F) * kMax + 0.5F);
}

// Channels of an EXR may be anything.
void RequireExrOfColours(const ImageFacts& facts, const fs::path& file) {
  if (facts.x != facts.full_x || facts.y != facts.full_y || facts.width != facts.full_width ||
      facts.height != facts.full_height) {
    throw Error(fmt::format(
        "{}: its data window ({}x{} from {}, {}) is not its display window ({}x{} from {}, {}): a "
        "photo must fill its display window and not exceed it; crop or pad it to that",
        file.string(), facts.width, facts.height, facts.x, facts.y, facts.full_width,
        facts.full_height, facts.full_x, facts.full_y));
  }
  const auto last_part = [](const std::string& name) {
    return name.substr(name.rfind('.') == std::string::npos ? 0 : name.rfind('.') + 1);
  };
  std::string first;
  for (size_t i = 0; i < 3 && i < facts.channel_names.size(); ++i) {
    first += last_part(facts.channel_names[i]);
  }
  // OpenImageIO 2.5 gives them as R, G and B, and says so.
  if (facts.Int("openexr:luminancechroma", 0) != 0 || first == "YRYBY" || first == "YBYRY" ||
      first == "BYRYY" || first == "BYYRY" || first == "RYBYY" || first == "RYYBY") {
    throw Error(
        fmt::format("{}: a luminance-chroma EXR is not supported; write it as RGB", file.string()));
  }
  if (facts.channels >= 3 && first != "RGB" && first != "rgb") {
    throw Error(
        fmt::format("{}: an EXR of a photo needs the channels R, G and B (or Y alone), its "
                    "channels are {}",
                    file.string(), NamesOf(facts.channel_names)));
  }
}

// libtiff converts these with constants of its own: CIELab without adapting its white.
void RequireTiffOfColours(const ImageFacts& facts, const fs::path& file) {
  constexpr std::array<int, 5> kOthers{8, 9, 10, 32844, 32845};  // three of Lab, LogL, LogLuv
  const int photometric = facts.Int("tiff:PhotometricInterpretation", 2);
  if (std::find(kOthers.begin(), kOthers.end(), photometric) == kOthers.end()) return;
  throw Error(fmt::format("{}: a TIFF of {} colours is not supported; export it as sRGB",
                          file.string(), photometric < 11 ? "Lab" : "logarithmic"));
}

}  // namespace

struct PhotoColours::Conversion {
  std::optional<SrgbConverter> by_numbers;
  bool linear_floats = false;
  Transform rgb, grey;      // by profile; 8 bits of RGB out
  bool eight_bits = false;  // in, else 16

  bool UseProfile(const std::vector<std::uint8_t>& icc, int channels, std::string& why_not);
  bool ChangesNothing() const;
  // `out`: three numbers a pixel; `values`: as many, of profiles of grey one.
  void ByProfile(const float* values, size_t pixels, std::uint8_t* out) const;
  void ByNumbers(const float* values, size_t pixels, std::uint8_t* out) const;
};

// False where the profile is none, or none for so many channels.
bool PhotoColours::Conversion::UseProfile(const std::vector<std::uint8_t>& icc, int channels,
                                          std::string& why_not) {
  static cmsContext const context = [] {
    cmsContext quiet = cmsCreateContext(nullptr, nullptr);
    cmsSetLogErrorHandlerTHR(quiet, [](cmsContext, cmsUInt32Number, const char*) {});
    return quiet;
  }();
  const Profile from(
      cmsOpenProfileFromMemTHR(context, icc.data(), static_cast<cmsUInt32Number>(icc.size())));
  if (!from) {
    why_not = "its colour profile cannot be read; its colours are taken as sRGB";
    return false;
  }
  const cmsColorSpaceSignature wanted = channels == 3 ? cmsSigRgbData : cmsSigGrayData;
  if (cmsGetColorSpace(from.get()) != wanted) {
    why_not = "its colour profile is not for " + std::string(channels == 3 ? "RGB" : "grey") +
              " and is not applied";
    return false;
  }
  const Profile to(cmsCreate_sRGBProfileTHR(context));
  Transform& transform = channels == 3 ? rgb : grey;
  // Of 8 bits lcms2 computes matrices exactly and fast; of 16 it would interpolate in a table.
  const cmsUInt32Number in8 = channels == 3 ? TYPE_RGB_8 : TYPE_GRAY_8;
  const cmsUInt32Number in16 = channels == 3 ? TYPE_RGB_16 : TYPE_GRAY_16;
  transform.reset(cmsCreateTransformTHR(context, from.get(), eight_bits ? in8 : in16, to.get(),
                                        TYPE_RGB_8, INTENT_RELATIVE_COLORIMETRIC,
                                        cmsFLAGS_NOCACHE | (eight_bits ? 0 : cmsFLAGS_NOOPTIMIZE)));
  if (transform) return true;
  why_not = "its colour profile cannot be used; its colours are taken as sRGB";
  return false;
}

// By trial on a grid of colours.
bool PhotoColours::Conversion::ChangesNothing() const {
  const size_t channels = rgb ? 3 : 1;
  const int count = channels == 3 ? kGridSteps * kGridSteps * kGridSteps : kGridSteps;
  for (int i = 0; i < count; ++i) {
    std::array<float, 3> in{};
    std::array<std::uint8_t, 3> out{};
    int rest = i;
    for (size_t c = 0; c < channels; ++c, rest /= kGridSteps) {
      in[c] = static_cast<float>(rest % kGridSteps) / (kGridSteps - 1);
    }
    ByProfile(in.data(), 1, out.data());
    for (size_t c = 0; c < 3; ++c) {
      if (std::abs(out[c] - 255 * in[channels == 3 ? c : 0]) > kSameLevels + 0.5F) return false;
    }
  }
  return true;
}

void PhotoColours::Conversion::ByProfile(const float* values, size_t pixels,
                                         std::uint8_t* out) const {
  const size_t count = pixels * (rgb ? 3 : 1);
  void* transform = (rgb ? rgb : grey).get();
  if (eight_bits) {
    std::vector<std::uint8_t> numbers(count);
    std::transform(values, values + count, numbers.begin(), NumberOf<std::uint8_t>);
    cmsDoTransform(transform, numbers.data(), out, static_cast<cmsUInt32Number>(pixels));
  } else {
    std::vector<std::uint16_t> numbers(count);
    std::transform(values, values + count, numbers.begin(), NumberOf<std::uint16_t>);
    cmsDoTransform(transform, numbers.data(), out, static_cast<cmsUInt32Number>(pixels));
  }
}

void PhotoColours::Conversion::ByNumbers(const float* values, size_t pixels,
                                         std::uint8_t* out) const {
  if (linear_floats) return by_numbers->ConvertLinear(values, pixels, out);
  std::vector<std::uint16_t> numbers(3 * pixels);
  std::transform(values, values + 3 * pixels, numbers.begin(), NumberOf<std::uint16_t>);
  by_numbers->Convert(numbers.data(), pixels, out);
}

PhotoColours::PhotoColours(const ImageFacts& facts, const std::string& format,
                           const fs::path& file) {
  const FileColours stated = ReadFileColours(file);
  if (!stated.unsupported.empty()) {
    throw Error(fmt::format("{}: {} are not supported; export it as sRGB", file.string(),
                            stated.unsupported));
  }
  const bool is_exr = !facts.channel_names.empty() && format == "openexr";
  if (is_exr) RequireExrOfColours(facts, file);
  RequireTiffOfColours(facts, file);
  std::optional<ColourCoding> coding = stated.coding;
  if (!coding && IsFloat(facts.sample)) coding = CodingOfChromaticities(facts);
  const std::vector<std::uint8_t> icc = stated.icc.empty() ? facts.Bytes("ICCProfile") : stated.icc;
  if (!coding && icc.empty() && IsAdobeRgbByExif(facts)) coding = AdobeRgb();

  auto conversion = std::make_unique<Conversion>();
  conversion->linear_floats = IsFloat(facts.sample);
  conversion->eight_bits = facts.sample == Sample::kUint8;
  if (coding) {
    const bool same_transfer =
        coding->transfer == (IsFloat(facts.sample) ? Transfer::kLinear : Transfer::kSrgb);
    if (AreSrgbs(coding->primaries)) coding->primaries = {};
    if (same_transfer && AreSrgbs(coding->primaries)) return;
    try {
      conversion->by_numbers.emplace(*coding);
    } catch (const std::invalid_argument&) {
      throw Error(fmt::format(
          "{}: its primaries (chromaticities) span no colours; export it as sRGB", file.string()));
    }
    conversion_ = std::move(conversion);
    return;
  }
  if (icc.empty()) return;
  std::string why_not;
  if (!conversion->UseProfile(icc, facts.channels >= 3 ? 3 : 1, why_not)) {
    remarks_.push_back(why_not);
  } else if (!conversion->ChangesNothing()) {
    conversion_ = std::move(conversion);
  }
}

PhotoColours::~PhotoColours() = default;

bool PhotoColours::converts() const { return conversion_ != nullptr; }

void PhotoColours::Convert(const std::vector<float>& values, int channels,
                           std::vector<std::uint8_t>& srgb) const {
  constexpr size_t kAtOnce = 4096;  // pixels
  const auto step = static_cast<size_t>(channels);
  const size_t pixels = values.size() / step;
  const size_t in_step = conversion_->grey ? 1 : 3;
  std::vector<float> in(in_step * kAtOnce);
  std::vector<std::uint8_t> out(3 * kAtOnce);
  for (size_t begin = 0; begin < pixels; begin += kAtOnce) {
    const size_t count = std::min(kAtOnce, pixels - begin);
    for (size_t i = 0; i < in_step * count; ++i) {
      in[i] = values[(begin + i / in_step) * step + (channels == 3 ? i % in_step : 0)];
    }
    if (conversion_->by_numbers) {
      conversion_->ByNumbers(in.data(), count, out.data());
    } else {
      conversion_->ByProfile(in.data(), count, out.data());
    }
    for (size_t i = 0; i < step * count; ++i) {
      srgb[begin * step + i] = out[3 * (i / step) + (channels == 3 ? i % step : 1)];
    }
  }
}

}  // namespace dtr::io
