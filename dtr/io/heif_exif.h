// dtr/io/heif_exif.h -- internal to dtr/io: EXIF data of HEIF and AVIF files.
#pragma once
#include <filesystem>
#include <string>

namespace dtr::io {

/// The TIFF structure of a HEIF or AVIF file's Exif item (ISO 23008-12, annex A.2.1), wherever its
/// offset says it begins: OpenImageIO 2.4 looks at one place alone. Empty where there is none,
/// where it lies elsewhere than in the file or in `idat`, or where a number of the file is broken.
std::string ReadHeifExif(const std::filesystem::path& file);

}  // namespace dtr::io
