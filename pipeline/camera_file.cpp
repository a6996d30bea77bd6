#include "pipeline/camera_file.h"

#include <fmt/format.h>

#include "calib/colmap/model_io.h"
#include "calib/files/calibration.h"
#include "calib/files/rig_files.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {

calib::LensCamera ReadLens(const std::filesystem::path& file) {
  const auto only_one = [&file](size_t cameras) {
    if (cameras == 1) return;
    throw Error(
        fmt::format("{}: expected one camera, found {}; give a file with the camera that "
                    "took the photos",
                    file.string(), cameras));
  };
  const std::string extension = file.extension().string();
  if (extension == ".json") {
    const calib::Calibration calibration = calib::ReadCalibration(file);
    only_one(calibration.cameras.size());
    return calibration.cameras.front().camera;
  }
  if (extension == ".yml" || extension == ".yaml" || extension == ".xml" ||
      extension == ".cameramodel") {
    const calib::CameraFile cameras = calib::ReadCamerasOf(file);
    only_one(cameras.cameras.size());
    return cameras.cameras.front().camera;
  }
  if (extension == ".txt") {
    const auto cameras = colmap::ReadCamerasText(file);
    only_one(cameras.size());
    return cameras.begin()->second;
  }
  throw UsageError(
      fmt::format("{}: expected a .json of `dtr calibrate board`, a .yml or .xml of OpenCV, ROS, "
                  "Kalibr or ORB-SLAM, a .cameramodel of mrcal or a cameras.txt of COLMAP",
                  file.string()));
}

}  // namespace dtr::pipeline
