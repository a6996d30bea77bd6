#include "dtr/io/oiio_files.h"

#include <OpenImageIO/filesystem.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/io/file_checks.h"
#include "dtr/io/whole_images.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

// One line, without the full stop and line breaks that decoders add. Some complain of every row.
std::string OneLine(std::string text) {
  constexpr size_t kLongest = 200;
  if (text.size() > kLongest) text.resize(std::min(kLongest, text.find('\n')));
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text;
}

// Our loops run over files, so OpenImageIO's own threads would only compete with them.
void SetUpOnce() {
  static std::once_flag once;
  std::call_once(once, [] {
    OIIO::attribute("exr_threads", -1);
    try {
      OIIO::attribute("threads", 1);
    } catch (const std::system_error&) {
      // It starts a thread that it does not use, and the system may have none left.
    }
  });
}

// What OpenImageIO is asked for.
OIIO::ImageSpec WishesFor(const std::optional<RawBalance>& raw_balance) {
  OIIO::ImageSpec wishes;  // raw colours: alpha is dropped, not multiplied in
  wishes.attribute("oiio:UnassociatedAlpha", 1);
  // Of raw files: brightness as exposed, for neighbouring photos must show one surface alike.
  wishes.attribute("raw:auto_bright", 0);
  wishes.attribute("raw:adjust_maximum_thr", 0.0f);
  if (raw_balance) {
    const std::array<float, 4> factors{
        static_cast<float>((*raw_balance)[0]), static_cast<float>((*raw_balance)[1]),
        static_cast<float>((*raw_balance)[2]), static_cast<float>((*raw_balance)[1])};
    wishes.attribute("raw:use_camera_wb", 0);
    wishes.attribute("raw:user_mul", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 4), factors.data());
  }
  return wishes;
}

// Decoders compute sizes in 32 bits, and containers of such sizes are a fault of the file.
template <typename Decode>
auto Decoded(const fs::path& file, const Decode& decode) {
  try {
    return decode();
  } catch (const std::length_error&) {
    throw Error(file.string() + ": damaged image: its sizes are beyond what its decoder can count");
  }
}

void ExpectAtMost(const fs::path& file, std::uint64_t width, std::uint64_t height,
                  std::uint64_t limit_px) {
  if (height == 0 || width <= limit_px / height) return;
  throw Error(file.string() + ": expected at most " + std::to_string(limit_px) + " pixels, found " +
              std::to_string(width) + "x" + std::to_string(height));
}

void ExpectMemoryFor(const fs::path& file, std::uint64_t width, std::uint64_t height, double bytes,
                     double memory_gb) {
  RequireMemory(bytes, memory_gb,
                file.string() + ": reading its " + std::to_string(width) + "x" +
                    std::to_string(height) + " pixels",
                "give more, or shrink the image");
}

void ExpectWithin(const fs::path& file, const std::optional<WholeImage>& image,
                  const OpenLimits& limits) {
  if (!image) return;
  ExpectAtMost(file, image->width_px, image->height_px, limits.px);
  ExpectPlausibleSize(file, image->width_px, image->height_px, image->format);
  ExpectMemoryFor(file, image->width_px, image->height_px, image->bytes(), limits.memory_gb);
}

// Photos come out 7 % larger than at zlib's own level 6, in a third of the time (docs/FORMAT.md).
constexpr int kPngLevel = 2;

}  // namespace

std::unique_ptr<OIIO::ImageInput> OpenImage(const fs::path& file, const OpenLimits& limits,
                                            const std::optional<RawBalance>& raw_balance) {
  SetUpOnce();
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw Error(file.string() + ": expected an image file, found " +
                (fs::exists(file, error) ? "something else" : "nothing"));
  }
  ExpectImageKind(file);
  ExpectWholeFile(file);
  ExpectWithin(file, LookAtWholeImage(file), limits);
  OIIO::ImageSpec wishes = WishesFor(raw_balance);
  auto in = Decoded(file, [&] { return OIIO::ImageInput::open(file.string(), &wishes); });
  if (!in) throw Error(file.string() + ": no readable image: " + OneLine(OIIO::geterror()));
  const OIIO::ImageSpec& spec = in->spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1) {
    throw Error(file.string() + ": expected a flat image, found " + std::to_string(spec.width) +
                "x" + std::to_string(spec.height) + "x" + std::to_string(spec.depth) + " with " +
                std::to_string(spec.nchannels) + " channels");
  }
  const auto width = static_cast<std::uint64_t>(spec.width);
  const auto height = static_cast<std::uint64_t>(spec.height);
  ExpectAtMost(file, width, height, limits.px);
  ExpectPlausibleSize(file, width, height, in->format_name());
  if (spec.tile_width > 0 && spec.tile_height > 0) {
    ExpectPlausibleSize(file, static_cast<std::uint64_t>(spec.tile_width),
                        static_cast<std::uint64_t>(spec.tile_height), in->format_name());
  }
  return in;
}

double DecoderBytes(const OIIO::ImageInput& in, const fs::path& file) {
  if (const auto whole = LookAtWholeImage(file)) return whole->bytes();
  const OIIO::ImageSpec& spec = in.spec();
  const std::string format = in.format_name();
  // LibRaw: the sensor's numbers, four channels of 16 bits, and what it makes of them.
  constexpr double kRawBytes = 24;
  const double bytes_per_px = format == "raw"    ? kRawBytes
                              : format == "jpeg" ? 0
                                                 : static_cast<double>(spec.pixel_bytes(true));
  const double pixels = static_cast<double>(spec.width) * spec.height;
  // A tile may be larger than its image.
  return bytes_per_px * std::max(pixels, static_cast<double>(spec.tile_width) * spec.tile_height);
}

void ExpectMemory(const OIIO::ImageInput& in, const fs::path& file, double bytes,
                  double memory_gb) {
  ExpectMemoryFor(file, static_cast<std::uint64_t>(in.spec().width),
                  static_cast<std::uint64_t>(in.spec().height), bytes, memory_gb);
}

void ReadPixels(OIIO::ImageInput& in, const fs::path& file, int first_channel, int end_channel,
                OIIO::TypeDesc type, void* pixels) {
  const bool read =
      Decoded(file, [&] { return in.read_image(0, 0, first_channel, end_channel, type, pixels); });
  const std::string complaint = in.geterror();
  if (!read || !complaint.empty()) {
    throw Error(file.string() + ": damaged image: " + OneLine(complaint));
  }
}

std::string EncodeImage(const std::string& extension, const OIIO::ImageSpec& spec,
                        OIIO::TypeDesc type, const void* pixels) {
  SetUpOnce();
  const std::string name = "memory" + extension;
  auto out = OIIO::ImageOutput::create(name);
  OIIO::ImageSpec with_quality = spec;
  with_quality.attribute("png:compressionLevel", kPngLevel);
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  if (!out || !out->set_ioproxy(&memory) || !out->open(name, with_quality) ||
      !out->write_image(type, pixels) || !out->close()) {
    throw Error("image cannot be encoded as " + extension + ": " +
                OneLine(out ? out->geterror() : OIIO::geterror()));
  }
  return {bytes.begin(), bytes.end()};
}

void ExpectSize(const OIIO::ImageInput& in, const fs::path& file, int width_px, int height_px) {
  if (in.spec().width == width_px && in.spec().height == height_px) return;
  throw Error(file.string() + ": expected " + std::to_string(width_px) + "x" +
              std::to_string(height_px) + " pixels, found " + std::to_string(in.spec().width) +
              "x" + std::to_string(in.spec().height));
}

}  // namespace dtr::io
