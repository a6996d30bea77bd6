// pipeline/camera_file.h -- one known lens, whichever program wrote it.
#pragma once
#include <filesystem>

#include "calib/lens_camera.h"

namespace dtr::pipeline {

/// The one camera of a file: .json as `dtr calibrate board` writes it, .yml, .yaml or .xml of
/// OpenCV, ROS, Kalibr or ORB-SLAM and .cameramodel of mrcal (calib/files/rig_files.h), .txt of
/// COLMAP (cameras.txt). Throws UsageError on another extension, Error on a broken
/// file or one with several cameras.
calib::LensCamera ReadLens(const std::filesystem::path& file);

}  // namespace dtr::pipeline
