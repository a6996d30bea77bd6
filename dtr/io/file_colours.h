// dtr/io/file_colours.h -- internal: what PNG, WebP and HEIF files state of their colours, which
// OpenImageIO does not tell.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/io/colour_coding.h"

namespace dtr::io {

struct FileColours {
  std::vector<std::uint8_t> icc;       ///< an ICC profile, as the file has it
  std::optional<ColourCoding> coding;  ///< stated by numbers; goes before a profile
  std::string unsupported;             ///< what is stated and not supported; empty where all is
};

/// Of the first image. Broken structures state nothing: the decoder reports them.
FileColours ReadFileColours(const std::filesystem::path& file);

/// A WebP's EXIF as it stands in a TIFF, which OpenImageIO 2.4 does not read; empty where there is
/// none.
std::string ReadWebpExif(const std::filesystem::path& file);

}  // namespace dtr::io
