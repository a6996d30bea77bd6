#include "dtr/io/oiio_files.h"

#include <algorithm>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/io/file_checks.h"
#include "dtr/io/image_formats.h"
#include "dtr/io/plain_png.h"
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

}  // namespace

std::unique_ptr<OpenedImage> OpenImage(const fs::path& file, const OpenLimits& limits,
                                       const std::optional<RawBalance>& raw_balance) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw Error(file.string() + ": expected an image file, found " +
                (fs::exists(file, error) ? "something else" : "nothing"));
  }
  ExpectImageKind(file);
  ExpectWholeFile(file);
  ExpectWithin(file, LookAtWholeImage(file), limits);
  std::string complaint;
  auto in = OpenPlainPng(file);
  if (!in) {
    in = Decoded(file, [&] { return Codecs().Open(file.string(), raw_balance, complaint); });
  }
  if (!in) throw Error(file.string() + ": no readable image: " + OneLine(complaint));
  const ImageFacts& facts = in->facts();
  if (facts.width <= 0 || facts.height <= 0 || facts.channels <= 0 || facts.depth > 1) {
    throw Error(file.string() + ": expected a flat image, found " + std::to_string(facts.width) +
                "x" + std::to_string(facts.height) + "x" + std::to_string(facts.depth) + " with " +
                std::to_string(facts.channels) + " channels");
  }
  const auto width = static_cast<std::uint64_t>(facts.width);
  const auto height = static_cast<std::uint64_t>(facts.height);
  ExpectAtMost(file, width, height, limits.px);
  ExpectPlausibleSize(file, width, height, in->format());
  if (facts.tile_width > 0 && facts.tile_height > 0) {
    ExpectPlausibleSize(file, static_cast<std::uint64_t>(facts.tile_width),
                        static_cast<std::uint64_t>(facts.tile_height), in->format());
  }
  return in;
}

double DecoderBytes(const OpenedImage& in, const fs::path& file) {
  if (const auto whole = LookAtWholeImage(file)) return whole->bytes();
  const ImageFacts& facts = in.facts();
  const std::string format = in.format();
  // LibRaw: the sensor's numbers, four channels of 16 bits, and what it makes of them.
  constexpr double kRawBytes = 24;
  const double bytes_per_px = format == "raw"    ? kRawBytes
                              : format == "jpeg" ? 0
                                                 : static_cast<double>(facts.pixel_bytes);
  const double pixels = static_cast<double>(facts.width) * facts.height;
  // A tile may be larger than its image.
  return bytes_per_px * std::max(pixels, static_cast<double>(facts.tile_width) * facts.tile_height);
}

void ExpectMemory(const OpenedImage& in, const fs::path& file, double bytes, double memory_gb) {
  ExpectMemoryFor(file, static_cast<std::uint64_t>(in.facts().width),
                  static_cast<std::uint64_t>(in.facts().height), bytes, memory_gb);
}

void ReadPixels(OpenedImage& in, const fs::path& file, int first_channel, int end_channel,
                Sample sample, void* pixels) {
  std::string complaint;
  const bool read =
      Decoded(file, [&] { return in.Read(first_channel, end_channel, sample, pixels, complaint); });
  if (!read || !complaint.empty()) {
    throw Error(file.string() + ": damaged image: " + OneLine(complaint));
  }
}

std::string EncodeImage(const std::string& extension, const ImageToWrite& image, Sample sample,
                        const void* pixels) {
  if (extension == ".png") {
    if (auto bytes = EncodePlainPng(image, sample, pixels)) return *std::move(bytes);
  }
  std::string complaint;
  auto bytes = Codecs().Encode(extension, image, sample, pixels, complaint);
  if (bytes) return *std::move(bytes);
  throw Error("image cannot be encoded as " + extension + ": " + OneLine(complaint));
}

std::string ImageFormatList() { return Codecs().FormatList(); }

void ExpectSize(const OpenedImage& in, const fs::path& file, int width_px, int height_px) {
  if (in.facts().width == width_px && in.facts().height == height_px) return;
  throw Error(file.string() + ": expected " + std::to_string(width_px) + "x" +
              std::to_string(height_px) + " pixels, found " + std::to_string(in.facts().width) +
              "x" + std::to_string(in.facts().height));
}

}  // namespace dtr::io
