// pipeline/detail/render/novel_frames.h -- where `dtr render` looks from.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/types/camera.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"

namespace dtr::pipeline {

/// A camera to render, in the set's world frame.
struct NovelFrame {
  std::string name;  ///< stem of the file written for it
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
};

/// What was asked for; exactly one of the first four.
struct NovelCameraRequest {
  std::string like;                   ///< a view of the set
  std::filesystem::path camera_file;  ///< cameras.json with one camera
  std::filesystem::path path_file;    ///< cameras.json with several
  int fly_through_frames = 0;         ///< a path along the set's own cameras
  std::string size;                   ///< "WxH"; 0 for either keeps the camera's proportions
};

/// The cameras of a request. Throws UsageError for a malformed one, Error for a broken file.
std::vector<NovelFrame> NovelFrames(const DtrSet& set, const NovelCameraRequest& request);

/// The camera at a size given as "WxH" (empty: its own). Throws UsageError for a malformed one.
PinholeCamera WithSize(const PinholeCamera& camera, const std::string& size);

}  // namespace dtr::pipeline
