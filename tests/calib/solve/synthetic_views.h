// tests/calib/solve/synthetic_views.h -- exact views of a board by a known camera, and noise.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/observations.h"
#include "calib/lens_map.h"
#include "calib/models/board_model.h"
#include "calib/solve/board_solve.h"
#include "dtr/base/random.h"

namespace dtr::calib::testing {

inline const Board kBoard{Board::Kind::kChessboard, 9, 6, 0.03, 0, "", false};

/// A camera of each model with distortion as real lenses have it, 640 x 480.
inline LensCamera TypicalCamera(BoardModel model) {
  const std::vector<double> params = [&]() -> std::vector<double> {
    switch (model) {
      case BoardModel::kPinhole:
        return {530, 532, 322, 236};
      case BoardModel::kBrown4:
        return {530, 532, 322, 236, -0.28, 0.08, 1e-3, -5e-4};
      case BoardModel::kBrown5:
        return {530, 532, 322, 236, -0.28, 0.08, 1e-3, -5e-4, 0.03};
      case BoardModel::kBrown8:
        return {530, 532, 322, 236, 0.3, 0.1, 1e-3, -5e-4, 0.02, 0.55, 0.15, 0.02};
      case BoardModel::kFisheye:
        return {210, 211, 322, 236, 0.05, -0.01, 0.004, -0.001};
    }
    return {};
  }();
  return CameraFrom(model, 640, 480, params);
}

struct SyntheticViews {
  std::vector<BoardView> views;
  std::vector<Pose> cam_from_board;
};

/// `count` views of the board, tilted by up to `tilt_deg` and anywhere in the image, every corner
/// of them inside the image; pixels exact.
inline SyntheticViews ExactViews(const LensCamera& camera, int count, std::uint64_t seed,
                                 double tilt_deg = 40, const Board& board = kBoard) {
  const LensMap lens(camera);
  Random random(seed);
  SyntheticViews out;
  const double length = board.square * board.columns;
  while (static_cast<int>(out.views.size()) < count) {
    const Eigen::Vector2d aim(random.Uniform(0.15, 0.85) * camera.width_px,
                              random.Uniform(0.15, 0.85) * camera.height_px);
    const auto ray = lens.RayFromPixel(aim);
    if (!ray) continue;
    const double tilt = random.Uniform(0, tilt_deg) * std::numbers::pi / 180;
    const double about = random.Uniform(0, 2 * std::numbers::pi);
    Pose pose;
    // Faces the camera along the ray, then tilts, then turns in its plane.
    pose.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), *ray) *
                    Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(about), std::sin(about), 0)) *
                    Eigen::AngleAxisd(random.Uniform(-0.5, 0.5), Eigen::Vector3d::UnitZ());
    const double distance = random.Uniform(1.2, 2.5) * length * camera.params[0] / 530;
    pose.translation = distance * *ray - pose.rotation * MiddleOf(board);
    BoardView view{"view" + std::to_string(out.views.size()), {}, 0};
    for (int id = 0; id < board.CornerCount(); ++id) {
      const auto pixel = lens.PixelFromCam(pose * board.Corner(id));
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > camera.width_px ||
          pixel->y() > camera.height_px) {
        break;
      }
      view.corners.push_back({id, *pixel});
    }
    if (static_cast<int>(view.corners.size()) < board.CornerCount()) continue;
    out.views.push_back(std::move(view));
    out.cam_from_board.push_back(pose);
  }
  return out;
}

/// The views with normal noise on each coordinate.
inline std::vector<BoardView> Noisy(std::vector<BoardView> views, double sigma_px,
                                    std::uint64_t seed) {
  Random random(seed);
  for (BoardView& view : views) {
    for (BoardCorner& corner : view.corners) {
      corner.pixel.x() += sigma_px * random.Normal();
      corner.pixel.y() += sigma_px * random.Normal();
    }
  }
  return views;
}

}  // namespace dtr::calib::testing
