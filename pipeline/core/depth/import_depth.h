// pipeline/core/depth/import_depth.h -- the depth map of one camera of an import. Internal.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/import/detail/import_views.h"

namespace dtr::pipeline {

/// The depth maps that a camera may mean: the one its list names, if it is there, else all with the
/// photo's name.
std::vector<std::filesystem::path> DepthFilesOf(const io::NamedCamera& named,
                                                const ImportOptions& options);

/// The depth map of a camera: the one its list names, else the only one with the photo's name.
/// Throws Error where there is none, or several.
std::filesystem::path DepthFileOf(const io::NamedCamera& named, const ImportOptions& options);

/// Plane z of that file on a grid that a set can hold, of the undistorted photo. `distortion` is
/// null where the camera has none. `resampled` gets a clause that says what was done where the map
/// had another grid.
DepthImage ReadCameraDepth(const io::NamedCamera& named, const ImportOptions& options,
                           const CameraDistortion* distortion, std::string& resampled);

}  // namespace dtr::pipeline
