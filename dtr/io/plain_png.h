// dtr/io/plain_png.h -- internal to dtr/io: PNG files such as sets have, by libpng alone. No
// library is loaded for them, and pixels, bytes and errors are those of OpenImageIO.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "dtr/io/image_codecs.h"

namespace dtr::io {

/// A PNG of one or three channels of 8 or 16 bits, not interlaced, which states nothing but its
/// size, and by whom it was written. None where the file is another one, or begins with damage.
std::unique_ptr<OpenedImage> OpenPlainPng(const std::filesystem::path& file);

/// The file of an image of 8 or 16 bits that states no more than that. None where it is to state
/// more, or libpng complains.
std::optional<std::string> EncodePlainPng(const ImageToWrite& image, Sample sample,
                                          const void* pixels);

}  // namespace dtr::io
