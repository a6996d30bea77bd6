#include "dtr/io/depth_io.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/io/code_bands.h"
#include "dtr/io/code_differences.h"
#include "dtr/io/oiio_files.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr float kLargestHalf = 65504;

// "ViewLayer.Depth.Z" -> {"viewlayer", "depth", "z"}.
std::vector<std::string> PartsOf(const std::string& channel) {
  std::vector<std::string> parts(1);
  for (const char c : channel) {
    if (c == '.') {
      parts.emplace_back();
    } else {
      parts.back() += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return parts;
}

bool IsDepthOfALayer(const std::string& channel) {
  const std::vector<std::string> parts = PartsOf(channel);
  const bool of_depth = parts.size() > 1 && parts[parts.size() - 2] == "depth";
  return parts.back() == "depth" ||
         (of_depth && (parts.back() == "z" || parts.back() == "y" || parts.back() == "v" ||
                       parts.back() == "r")) ||
         (parts.size() == 1 && parts.back() == "z");
}

// The channel Z or Y, else the one that a layer calls its depth (Blender: ViewLayer.Depth.Z), else
// the first of an image that holds nothing else.
int DepthChannel(const ImageFacts& facts, const fs::path& file) {
  const std::vector<std::string>& channels = facts.channel_names;
  for (const char* name : {"Z", "Y"}) {
    const auto channel = std::find(channels.begin(), channels.end(), name);
    if (channel != channels.end()) return static_cast<int>(channel - channels.begin());
  }
  std::vector<int> found;
  std::string names;
  bool plain = true;
  for (const std::string& name : channels) {
    if (IsDepthOfALayer(name)) found.push_back(static_cast<int>(&name - channels.data()));
    names += (&name == channels.data() ? "" : ", ") + name;
    plain = plain && (name == "R" || name == "G" || name == "B" || name == "A");
  }
  if (found.size() == 1) return found.front();
  if (found.empty() && (plain || facts.channels == 1)) return 0;
  throw Error(file.string() +
              ": expected one channel of depth, called Z, Y, depth or LAYER.Depth.Z, found " +
              names.substr(0, 200) + "; write the depth into a file of its own");
}

// Programs that render a part of an image write that part alone.
void ExpectWholeImage(const ImageFacts& facts, const fs::path& file) {
  if (facts.x == facts.full_x && facts.y == facts.full_y && facts.width == facts.full_width &&
      facts.height == facts.full_height) {
    return;
  }
  throw Error(file.string() + ": expected pixels for the whole image of " +
              std::to_string(facts.full_width) + "x" + std::to_string(facts.full_height) +
              ", found " + std::to_string(facts.width) + "x" + std::to_string(facts.height) +
              " of them from (" + std::to_string(facts.x - facts.full_x) + ", " +
              std::to_string(facts.y - facts.full_y) + ") on; write it without a border");
}

// Errors of the pure coding functions name a pixel; this puts the file in front.
template <typename Function>
auto Naming(const fs::path& file, const Function& function) {
  try {
    return function();
  } catch (const Error& error) {
    throw Error(file.string() + ": " + error.what());
  }
}

Grid<float> ReadFloatsOf(OpenedImage& in, const fs::path& file) {
  const ImageFacts& facts = in.facts();
  if (!IsFloat(facts.sample)) {
    throw Error(file.string() + ": expected float samples, found " + facts.sample_name +
                "; say how its numbers are coded");
  }
  ExpectWholeImage(facts, file);
  Grid<float> grid(facts.width, facts.height);
  const int channel = DepthChannel(facts, file);
  ReadPixels(in, file, channel, channel + 1, Sample::kFloat, grid.data().data());
  return grid;
}

Grid<std::uint16_t> ReadCodesOf(OpenedImage& in, const fs::path& file) {
  const ImageFacts& facts = in.facts();
  if (facts.sample != Sample::kUint16 || facts.channels != 1) {
    throw Error(file.string() + ": expected one channel of 16 bits, found " +
                std::to_string(facts.channels) + " of " + facts.sample_name);
  }
  Grid<std::uint16_t> grid(facts.width, facts.height);
  ReadPixels(in, file, 0, 1, Sample::kUint16, grid.data().data());
  return grid;
}

// How far rounding to its coding may carry a depth past the end of the range it was checked
// against.
double RoundingOf(DepthCoding coding, double z) {
  switch (coding) {
    case DepthCoding::kExrHalf:
      return 0x1.0p-11 * z;  // half of its last bit
    case DepthCoding::kPng16Millimetre:
      return 0.50001e-3;  // half a code, and float's rounding
    case DepthCoding::kExrFloat:
    case DepthCoding::kPng16InverseDepth:
    case DepthCoding::kZstdInverseDepth:
      break;  // both ends are stored exactly
  }
  return 0;
}

// `coding`: that of the numbers as they are; float for a map that was not rounded yet.
void ExpectInRange(const DepthImage& depth, const DepthFormat& format, DepthCoding coding) {
  const double low = static_cast<float>(format.near_z), high = static_cast<float>(format.far_z);
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const double z = depth(x, y);
      if (z == 0) continue;
      const double slack = RoundingOf(coding, z);
      if (z >= low - slack && z <= high + slack) continue;  // false for NaN
      throw Error("depth pixel (" + std::to_string(x) + ", " + std::to_string(y) +
                  "): expected 0 or a depth in [" + std::to_string(low) + ", " +
                  std::to_string(high) + "], found " + std::to_string(z));
    }
  }
}

DepthImage FromFloats(Grid<float> values) {
  DepthImage depth(values.width(), values.height());
  depth.grid() = std::move(values);
  return depth;
}

// Keeps 8 significant bits, ties to even; a carry into the exponent is right by design of IEEE
// 754. Numbers below float's normal range keep fewer, which no image measures.
float KeepEightBits(float value) {
  constexpr std::uint32_t kDropped = 16;  // of 23 stored mantissa bits
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t odd = (bits >> kDropped) & 1u;
  return std::bit_cast<float>((bits + (1u << (kDropped - 1)) - 1u + odd) &
                              ~((1u << kDropped) - 1u));
}

void ExpectSigma(const fs::path& file, const Grid<float>& sigma) {
  for (const float value : sigma.data()) {
    if (!(value >= 0) || !std::isfinite(value)) {
      throw Error(file.string() + ": expected finite sigmas of at least 0, found " +
                  std::to_string(value));
    }
  }
}

// Codes of a file of differences to a base, once that is the one they were written against.
Grid<std::uint16_t> ReadDifferences(const fs::path& file, const BaseFile& base, int width_px,
                                    int height_px) {
  const std::string bytes = ReadFile(file, MostDifferenceBytes(width_px, height_px));
  if (Naming(file, [&] { return BaseOfDifferences(bytes); }) != base.sha256) {
    throw Error(file.string() + ": expected differences to " + base.file.string() +
                ", as set.json says, found differences to another base");
  }
  const std::string of_base = ReadFile(base.file, MostBandBytes(width_px, height_px));
  if (Sha256(std::as_bytes(std::span(of_base))) != base.sha256) {
    throw Error(base.file.string() +
                ": expected the content that the set records, found another; dtr info with "
                "`verify` names every such file");
  }
  const auto codes = Naming(base.file, [&] { return DecodeBands(of_base, width_px, height_px); });
  return Naming(file, [&] { return DecodeDifferences(bytes, codes); });
}

// Codes of a file of our own coding.
Grid<std::uint16_t> ReadCodes(const fs::path& file, int width_px, int height_px,
                              const std::optional<BaseFile>& base) {
  if (base) return ReadDifferences(file, *base, width_px, height_px);
  const std::string bytes = ReadFile(file, MostBandBytes(width_px, height_px));
  return Naming(file, [&] { return DecodeBands(bytes, width_px, height_px); });
}

constexpr int kSigmaBits = 16;  // the upper ones of float32 hold eight significant bits

void WriteFloats(const fs::path& file, const Grid<float>& grid,
                 const std::vector<std::string>& channels, Sample sample, Mark mark) {
  ImageToWrite image{
      grid.width(),
      grid.height(),
      grid.channels(),
      sample,
      {{"compression", "zip"}, {"DateTime", ""}},  // else OpenImageIO writes the time of day
      channels};
  if (mark == Mark::kRendered) image.attributes.emplace_back("Software", kRenderedSoftware);
  WriteFileAtomically(file, EncodeImage(".exr", image, Sample::kFloat, grid.data().data()));
}

}  // namespace

Grid<float> ReadFloatGrid(const fs::path& file, std::uint64_t limit_px) {
  return ReadFloatsOf(*OpenImage(file, {limit_px}), file);
}

void WriteExr(const fs::path& file, const Grid<float>& grid, bool half, Mark mark) {
  if (grid.empty() || grid.channels() != 1) {
    throw Error(file.string() + ": expected one channel of floats to write");
  }
  if (half) {
    for (const float value : grid.data()) {
      if (std::abs(value) > kLargestHalf) {
        throw Error(file.string() + ": expected values within half's range, 65504, found " +
                    std::to_string(value));
      }
    }
  }
  WriteFloats(file, grid, {"Y"}, half ? Sample::kHalf : Sample::kFloat, mark);
}

void WriteExrOfVectors(const fs::path& file, const Grid<float>& grid, Mark mark) {
  if (grid.empty() || grid.channels() != 3) {
    throw Error(file.string() + ": expected three channels of floats to write");
  }
  WriteFloats(file, grid, {"X", "Y", "Z"}, Sample::kFloat, mark);
}

Grid<std::uint16_t> ReadPng16(const fs::path& file, std::uint64_t limit_px) {
  return ReadCodesOf(*OpenImage(file, {limit_px}), file);
}

void WritePng16(const fs::path& file, const Grid<std::uint16_t>& grid) {
  if (grid.empty() || grid.channels() != 1) {
    throw Error(file.string() + ": expected one channel of 16 bits to write");
  }
  const ImageToWrite image{grid.width(), grid.height(), 1, Sample::kUint16};
  WriteFileAtomically(file, EncodeImage(".png", image, Sample::kUint16, grid.data().data()));
}

void WriteDepth(const fs::path& file, const DepthImage& depth, const DepthFormat& format) {
  const DepthImage stored = Naming(file, [&] {
    ExpectInRange(depth, format, DepthCoding::kExrFloat);
    return RoundToCoding(depth, format);
  });
  switch (format.coding) {
    case DepthCoding::kExrFloat:
      return WriteExr(file, stored.grid(), false);
    case DepthCoding::kExrHalf:
      return WriteExr(file, stored.grid(), true);
    case DepthCoding::kPng16Millimetre:
      return WritePng16(file, EncodePng16Millimetre(stored));
    case DepthCoding::kPng16InverseDepth:
    case DepthCoding::kZstdInverseDepth:
      break;
  }
  // Encoding the rounded map again gives the same codes (tested), so nothing is rounded twice.
  const auto codes = EncodeInverseDepth(stored, format.near_z, format.far_z, StepsOf(format));
  if (format.coding == DepthCoding::kPng16InverseDepth) return WritePng16(file, codes);
  WriteFileAtomically(file, EncodeBands(codes));
}

DepthImage ReadDepth(const fs::path& file, const DepthFormat& format, int width_px, int height_px,
                     const std::optional<BaseFile>& base) {
  if (format.coding == DepthCoding::kZstdInverseDepth) {
    // Codes say by themselves that they lie in the range.
    const auto codes = ReadCodes(file, width_px, height_px, base);
    return Naming(
        file, [&] { return DecodeInverseDepth(codes, format.near_z, format.far_z, format.steps); });
  }
  const auto in = OpenImage(file);
  ExpectSize(*in, file, width_px, height_px);
  return Naming(file, [&] {
    DepthImage depth;
    switch (format.coding) {
      case DepthCoding::kExrFloat:
      case DepthCoding::kExrHalf:
        depth = FromFloats(ReadFloatsOf(*in, "depth"));
        break;
      case DepthCoding::kPng16Millimetre:
        depth = DecodePng16Millimetre(ReadCodesOf(*in, "depth"));
        break;
      case DepthCoding::kPng16InverseDepth:
        depth = DecodeInverseDepth(ReadCodesOf(*in, "depth"), format.near_z, format.far_z);
        break;
      case DepthCoding::kZstdInverseDepth:
        break;  // read above
    }
    ExpectInRange(depth, format, format.coding);
    return depth;
  });
}

void WriteSigma(const fs::path& file, const Grid<float>& inverse_depth_sigma) {
  ExpectSigma(file, inverse_depth_sigma);
  Grid<float> rounded = inverse_depth_sigma;
  for (float& value : rounded.data()) value = KeepEightBits(value);
  WriteExr(file, rounded, false);
}

Grid<float> ReadSigma(const fs::path& file, int width_px, int height_px,
                      const std::optional<BaseFile>& base) {
  Grid<float> sigma(width_px, height_px);
  if (base) {
    const auto codes = ReadCodes(file, width_px, height_px, base);
    std::transform(codes.data().begin(), codes.data().end(), sigma.data().begin(),
                   [](std::uint16_t code) {
                     return std::bit_cast<float>(static_cast<std::uint32_t>(code) << kSigmaBits);
                   });
  } else {
    const auto in = OpenImage(file);
    ExpectSize(*in, file, width_px, height_px);
    sigma = ReadFloatsOf(*in, file);
  }
  ExpectSigma(file, sigma);
  return sigma;
}

Grid<std::uint16_t> ReadDepthCodes(const fs::path& file, const DepthFormat& format, int width_px,
                                   int height_px) {
  if (format.coding == DepthCoding::kZstdInverseDepth) {
    return ReadCodes(file, width_px, height_px, {});
  }
  if (format.coding != DepthCoding::kPng16InverseDepth) {
    throw std::invalid_argument("ReadDepthCodes: expected a coding of inverse depth in steps");
  }
  const auto in = OpenImage(file);
  ExpectSize(*in, file, width_px, height_px);
  return ReadCodesOf(*in, file);
}

std::optional<Grid<std::uint16_t>> SigmaCodes(const Grid<float>& inverse_depth_sigma) {
  Grid<std::uint16_t> codes(inverse_depth_sigma.width(), inverse_depth_sigma.height());
  for (size_t i = 0; i < codes.data().size(); ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(inverse_depth_sigma.data()[i]);
    if ((bits & ((1u << kSigmaBits) - 1u)) != 0) return {};
    codes.data()[i] = static_cast<std::uint16_t>(bits >> kSigmaBits);
  }
  return codes;
}

}  // namespace dtr::io
