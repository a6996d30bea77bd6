// dtr/io/whole_images.h -- internal to dtr/io: images whose decoders unpack them whole as soon as
// they are opened. Their sizes must be known before.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace dtr::io {

struct WholeImage {
  std::uint64_t width_px = 0, height_px = 0;
  double bytes_per_px = 0;  ///< what the decoder holds at its peak
  std::string format;       ///< as OpenImageIO calls it, where ExpectPlausibleSize knows it
  double bytes() const {
    return bytes_per_px * static_cast<double>(width_px) * static_cast<double>(height_px);
  }
};

/// What a GIF, WebP, HEIF, AVIF, JPEG 2000, progressive JPEG or packed BMP file states: the largest
/// of its sizes where it has several. Nothing of other files, or where the size is not there.
std::optional<WholeImage> LookAtWholeImage(const std::filesystem::path& file);

}  // namespace dtr::io
