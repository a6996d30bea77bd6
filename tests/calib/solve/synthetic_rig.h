// tests/calib/solve/synthetic_rig.h -- a board moved before cameras that are fixed to each other.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "calib/solve/rig_solve.h"
#include "tests/calib/solve/synthetic_views.h"

namespace dtr::calib::testing {

/// `count` cameras of a model in a row, `baseline` apart (board units), turned inwards a little.
inline std::vector<RigCamera> RowOfCameras(int count, double baseline,
                                           BoardModel model = BoardModel::kBrown4) {
  std::vector<RigCamera> cameras;
  for (int c = 0; c < count; ++c) {
    Pose rig_from_cam;
    rig_from_cam.rotation = Eigen::AngleAxisd(-0.12 * c, Eigen::Vector3d::UnitY());
    rig_from_cam.translation = {c * baseline, 0.01 * c, 0};
    cameras.push_back({"cam" + std::to_string(c), model, TypicalCamera(model),
                       c == 0 ? Pose{} : rig_from_cam.Inverse()});
  }
  return cameras;
}

/// Frames in which at least `least` cameras see the whole board; pixels exact. With `smooth` the
/// board moves along a smooth path (a sequence), else it jumps.
inline Rig ExactRig(const std::vector<RigCamera>& cameras, size_t frames, std::uint64_t seed,
                    bool smooth = false, size_t least = 1, const Board& board = kBoard,
                    double tilt_deg = 40) {
  Rig rig;
  rig.cameras = cameras;
  Random random(seed);
  const double length = board.square * board.columns;
  std::vector<double> phase;
  for (int i = 0; i < 6; ++i) phase.push_back(random.Uniform(0, 2 * std::numbers::pi));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // of the cameras
  for (const RigCamera& camera : cameras) {
    middle += camera.cam_from_rig.TargetOriginInSource() / static_cast<double>(cameras.size());
  }
  for (int trial = 0; rig.rig_from_board.size() < frames && trial < 100000; ++trial) {
    const auto draw = [&](size_t i, double speed) {
      return smooth ? std::sin(speed * trial + phase[i]) : random.Uniform(-1, 1);
    };
    Pose pose;
    const double tilt = tilt_deg * std::numbers::pi / 180;
    pose.rotation = Eigen::AngleAxisd(tilt * draw(0, 0.23), Eigen::Vector3d::UnitX()) *
                    Eigen::AngleAxisd(tilt * draw(1, 0.31), Eigen::Vector3d::UnitY()) *
                    Eigen::AngleAxisd(0.5 * draw(2, 0.17), Eigen::Vector3d::UnitZ());
    const double depth = (1.9 + 0.6 * draw(3, 0.13)) * length;
    pose.translation =
        middle + Eigen::Vector3d(0.42 * depth * draw(4, 0.19), 0.3 * depth * draw(5, 0.29), depth) -
        pose.rotation * MiddleOf(board);
    std::vector<RigView> seen;
    for (size_t c = 0; c < cameras.size(); ++c) {
      RigView view{c, rig.rig_from_board.size(), {}, {}};
      view.seen.name = cameras[c].name + "/" + std::to_string(view.frame);
      const LensMap lens(cameras[c].camera);
      for (int id = 0; id < board.CornerCount(); ++id) {
        const auto pixel = lens.PixelFromCam(cameras[c].cam_from_rig * (pose * board.Corner(id)));
        if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > cameras[c].camera.width_px ||
            pixel->y() > cameras[c].camera.height_px) {
          break;
        }
        view.seen.corners.push_back({id, *pixel});
      }
      if (static_cast<int>(view.seen.corners.size()) == board.CornerCount()) {
        seen.push_back(std::move(view));
      }
    }
    if (seen.size() < least) continue;
    rig.views.insert(rig.views.end(), seen.begin(), seen.end());
    rig.rig_from_board.push_back(pose);
  }
  return rig;
}

inline std::vector<RigView> NoisyViews(const Rig& rig, double sigma_px, std::uint64_t seed) {
  Random random(seed);
  std::vector<RigView> views = rig.views;
  for (RigView& view : views) {
    view.seen.noise_px = sigma_px;
    for (BoardCorner& corner : view.seen.corners) {
      corner.pixel.x() += sigma_px * random.Normal();
      corner.pixel.y() += sigma_px * random.Normal();
    }
  }
  return views;
}

inline std::vector<RigCameraInput> InputsOf(const std::vector<RigCamera>& cameras) {
  std::vector<RigCameraInput> inputs;
  for (const RigCamera& camera : cameras) {
    inputs.push_back(
        {camera.name, camera.model, camera.camera.width_px, camera.camera.height_px, {}});
  }
  return inputs;
}

}  // namespace dtr::calib::testing
