// pipeline/novel_frames.h -- the cameras of a request to render.
#pragma once
#include <string>
#include <vector>

#include "dtr/types/camera.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"
#include "pipeline/render.h"

namespace dtr::pipeline {

/// A camera to render, in the set's world frame.
struct NovelFrame {
  std::string name;  ///< stem of the file written for it
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
};

/// The cameras of a request. Throws UsageError for a malformed one, Error for a broken file.
std::vector<NovelFrame> NovelFrames(const DtrSet& set, const NovelCameraRequest& request);

/// The camera at a size given as "WxH" (empty: its own). Throws UsageError for a malformed one.
PinholeCamera WithSize(const PinholeCamera& camera, const std::string& size);

}  // namespace dtr::pipeline
