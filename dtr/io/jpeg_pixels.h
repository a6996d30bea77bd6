// dtr/io/jpeg_pixels.h -- internal to dtr/io: the pixels of a JPEG, by libjpeg itself.
#pragma once
#include <cstdint>
#include <filesystem>

#include "dtr/types/grid.h"

namespace dtr::io {

/// The pixels of a JPEG of 8 bits: one channel of a grey one, RGB of others, no colour profile.
/// Inks become R = (255 - C) (255 - K) / 255 and so on; Adobe's programs store their amounts
/// inverted and say so by a marker (APP14, "Adobe"), without it 0 is no ink.
/// OpenImageIO reads the same pixels, and does not look at what follows the last row: a file with a
/// hole, or whose second half was never written, would pass for a photo. Throws Error where the
/// file is damaged: data that end early, are spoiled, or are left over behind the last row. Cameras
/// that leave a few bytes there or fill up with equal ones are forgiven.
Grid<std::uint8_t> ReadJpegPixels(const std::filesystem::path& file);

}  // namespace dtr::io
