// dtr/io/formats/record3d_file.h -- recordings of Record3D, which are ZIP archives. Internal to
// dtr/io/formats.
#pragma once
#include <filesystem>

namespace dtr::io::internal {

/// Writes what a .r3d file holds of a capture below `folder`, byte for byte: `metadata`, and of the
/// frames rgbd/N.jpg, rgbd/N.depth and rgbd/N.conf. Throws Error where the file is no whole
/// archive, has no metadata, or holds files that no frame has.
void UnpackRecord3d(const std::filesystem::path& file, const std::filesystem::path& folder);

}  // namespace dtr::io::internal
