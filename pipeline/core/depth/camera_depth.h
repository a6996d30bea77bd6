// pipeline/core/depth/camera_depth.h -- the depth map of one camera of a list.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/io/formats/foreign_confidence.h"
#include "pipeline/core/cameras/camera_distortion.h"

namespace dtr::pipeline {

/// Where the depth maps of a io::CameraList lie and what their numbers mean.
struct CameraDepthOptions {
  std::filesystem::path depth_dir;  ///< empty: there are none
  io::ConfidenceMaps confidence;    ///< of these depth maps
  /// What the depth numbers measure; empty: what the list says for each camera.
  std::optional<DepthKind> depth_kind;
  /// Scene units per number in a depth file. Empty: 1 for float files; whole numbers are
  /// rejected, as they are never scene units by themselves.
  std::optional<double> depth_unit;
  /// Views in memory at a time take at most so many 1e9 bytes, and one that alone takes more is
  /// rejected; 0: no bound.
  double memory_gb = 0;
};

/// The depth maps that a camera may mean: the one its list names, if it is there, else all with the
/// photo's name.
std::vector<std::filesystem::path> DepthFilesOf(const io::NamedCamera& named,
                                                const CameraDepthOptions& options);

/// The depth map of a camera: the one its list names, else the only one with the photo's name.
/// Throws Error where there is none, or several.
std::filesystem::path DepthFileOf(const io::NamedCamera& named, const CameraDepthOptions& options);

/// Plane z of that file on a grid that a set can hold, of the undistorted photo. `distortion` is
/// null where the camera has none. `resampled` gets a clause that says what was done where the map
/// had another grid.
DepthImage ReadCameraDepth(const io::NamedCamera& named, const CameraDepthOptions& options,
                           const CameraDistortion* distortion, std::string& resampled);

}  // namespace dtr::pipeline
