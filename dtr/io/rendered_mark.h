// dtr/io/rendered_mark.h -- images that were rendered say so in their files: in a folder of photos
// they are none.
#pragma once
#include <filesystem>

namespace dtr::io {

/// Whether a file that is written says that it was rendered.
enum class Mark { kNone, kRendered };

/// Stands for "Software" in PNG, JPEG (EXIF) and EXR files.
inline constexpr char kRenderedSoftware[] = "dtr: rendered, no photo";

/// Whether the beginning of a file holds kRenderedSoftware; false for what cannot be read.
bool IsRendered(const std::filesystem::path& file);

}  // namespace dtr::io
