// pipeline/render/novel_frames.h -- the cameras of a request to render.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/render/free_space.h"
#include "dtr/types/camera.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"
#include "pipeline/render/render.h"

namespace dtr::pipeline {

/// A camera to render, in the set's world frame.
struct NovelFrame {
  std::string name;  ///< stem of the file written for it
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
};

/// The cameras of a request. A file of cameras may be of any format that CameraFormats() names
/// (pipeline/import/import.h) but LLFF's; `notes`, where given, gets a line where its cameras have
/// distortion: frames are rendered without. Throws UsageError for a malformed request, Error for a
/// broken file.
std::vector<NovelFrame> NovelFrames(const DtrSet& set, const NovelCameraRequest& request,
                                    std::vector<std::string>* notes = nullptr);

/// Reads depth of the set in a folder; a view whose depth cannot be read stays without.
DepthLoader DepthLoaderOf(const std::filesystem::path& set_folder);

/// The camera at a size given as "WxH" (empty: its own). Throws UsageError for a malformed one.
PinholeCamera WithSize(const PinholeCamera& camera, const std::string& size);

}  // namespace dtr::pipeline
