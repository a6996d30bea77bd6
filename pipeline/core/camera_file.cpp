#include "pipeline/core/camera_file.h"

#include <fmt/format.h>

#include "calib/colmap/model_io.h"
#include "calib/files/calibration.h"
#include "calib/files/rig_files.h"
#include "calib/scaled_lens.h"
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

calib::LensCamera LensFor(const calib::LensCamera& lens, int width_px, int height_px,
                          const std::string& whose) {
  if (auto scaled = calib::ScaledLens(lens, width_px, height_px)) return std::move(*scaled);
  const bool upright = calib::ScaledLens(lens, height_px, width_px).has_value();
  throw Error(fmt::format(
      "`lens`: intrinsics of {} x {} px are not those of {}, which has {} x {} px: {}",
      lens.width_px, lens.height_px, whose, width_px, height_px,
      upright
          ? "it was rotated; give photos as the camera stored them"
          : "another aspect ratio, so it was cropped or is of another camera; give the intrinsics "
            "of these photos"));
}

}  // namespace dtr::pipeline
