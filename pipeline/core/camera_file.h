// pipeline/core/camera_file.h -- files of known cameras, whichever program wrote them.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "calib/lens_camera.h"

namespace dtr::pipeline {

/// The one camera of a file: .json as `dtr calibrate board` writes it, .yml, .yaml or .xml of
/// OpenCV, ROS, Kalibr or ORB-SLAM and .cameramodel of mrcal (calib/files/rig_files.h), .txt of
/// COLMAP (cameras.txt). Throws UsageError on another extension, Error on a broken
/// file or one with several cameras.
calib::LensCamera ReadLens(const std::filesystem::path& file);

/// The camera for an image of this size (calib/scaled_lens.h). Throws Error that names `whose`
/// where the aspect ratio is another.
calib::LensCamera LensFor(const calib::LensCamera& lens, int width_px, int height_px,
                          const std::string& whose);

/// The formats of ImportRequest::cameras and BuildOptions::poses, in byte order.
std::vector<std::string> CameraFormats();

}  // namespace dtr::pipeline
