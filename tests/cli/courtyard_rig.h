// tests/cli/courtyard_rig.h -- two cameras, left and right, fixed to each other in the courtyard.
#pragma once
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/files/calibration.h"
#include "tests/cli/small_courtyard.h"

namespace dtr::testing {

struct CourtyardRig {
  PinholeCamera left, right;
};

/// The right camera stands half a metre to the right and looks a little inwards.
inline Pose RightFromLeft() {
  Pose pose;
  pose.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(-0.06, Eigen::Vector3d(0.1, 1, 0).normalized()));
  pose.translation = pose.rotation * Eigen::Vector3d(-0.5, 0.02, 0.01);
  return pose;
}

/// left/0000.png ... of all time steps, then right/0000.png ...
inline std::vector<CourtyardPhoto> PhotosOf(const CourtyardRig& rig, int time_steps) {
  std::vector<CourtyardPhoto> photos;
  const std::vector<Pose> places = CourtyardArc(time_steps);
  for (const bool right : {false, true}) {
    for (int i = 0; i < time_steps; ++i) {
      const Pose& left = places[static_cast<size_t>(i)];
      photos.push_back({fmt::format("{}/{:04}.png", right ? "right" : "left", i),
                        right ? rig.right : rig.left, right ? RightFromLeft() * left : left});
    }
  }
  return photos;
}

/// What `dtr calibrate rig` would leave of it.
inline calib::Calibration CalibrationOf(const CourtyardRig& rig,
                                        const Pose& right_from_left = RightFromLeft()) {
  calib::Calibration calibration;
  calibration.board = calib::BoardFromText("chessboard:9x6:25mm");
  for (const bool right : {false, true}) {
    const PinholeCamera& c = right ? rig.right : rig.left;
    calib::CalibratedCamera camera;
    camera.name = right ? "right" : "left";
    camera.camera = {calib::CameraModel::kPinhole,
                     c.width_px(),
                     c.height_px(),
                     {c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px()}};
    camera.covariance = 0.01 * Eigen::MatrixXd::Identity(4, 4);
    camera.rms_px = camera.sigma_px = 0.1;
    if (right) {
      camera.cam_from_rig = right_from_left;
      camera.place_covariance = 1e-8 * Eigen::MatrixXd::Identity(6, 6);
    }
    calibration.cameras.push_back(std::move(camera));
  }
  return calibration;
}

}  // namespace dtr::testing
