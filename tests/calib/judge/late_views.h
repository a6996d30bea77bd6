// tests/calib/judge/late_views.h -- views of a board in the hand by cameras without a common clock.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "dtr/base/random.h"
#include "tests/calib/solve/synthetic_rig.h"

namespace dtr::calib::testing {

inline constexpr double kNoisePx = 0.1;
inline constexpr size_t kFrames = 30;
inline const std::vector<double> kDelays{0, 0.7, -0.35};

/// A board in the hand: no two of its motions have the same period.
inline Pose BoardAt(double time) {
  const auto swing = [&](double rate, double phase) { return std::sin(rate * time + phase); };
  const double length = kBoard.square * kBoard.columns;
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(0.6 * swing(0.10, 0.3), Eigen::Vector3d::UnitX()) *
                  Eigen::AngleAxisd(0.6 * swing(0.13, 1.1), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(0.4 * swing(0.07, 2.0), Eigen::Vector3d::UnitZ());
  pose.translation = Eigen::Vector3d(0.1 + 0.25 * swing(0.09, 0.5), 0.2 * swing(0.12, 4.0),
                                     2.0 + 0.4 * swing(0.05, 2.5)) *
                         length -
                     pose.rotation * MiddleOf(kBoard);
  return pose;
}

/// What cameras see that are late by `delays`: whole boards, with noise. `jitter`: standard
/// deviation of every image's own moment, in frames.
inline std::vector<RigView> LateViews(const std::vector<RigCamera>& cameras,
                                      const std::vector<double>& delays, std::uint64_t seed,
                                      double jitter = 0) {
  Random random(seed), moments(HashOf(seed, 1));
  std::vector<RigView> views;
  for (size_t f = 0; f < kFrames; ++f) {
    for (size_t c = 0; c < cameras.size(); ++c) {
      const LensMap lens(cameras[c].camera);
      const double moment = static_cast<double>(f) + delays[c] + jitter * moments.Normal();
      const Pose pose = cameras[c].cam_from_rig * BoardAt(moment);
      RigView view{c, f, {cameras[c].name + "/" + std::to_string(f), {}, kNoisePx}, {}};
      for (int id = 0; id < kBoard.CornerCount(); ++id) {
        const auto pixel = lens.PixelFromCam(pose * kBoard.Corner(id));
        const Eigen::Vector2d noise(random.Normal(), random.Normal());
        if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > 640 || pixel->y() > 480) {
          break;
        }
        view.seen.corners.push_back({id, *pixel + kNoisePx * noise});
      }
      if (static_cast<int>(view.seen.corners.size()) == kBoard.CornerCount()) {
        views.push_back(std::move(view));
      }
    }
  }
  return views;
}

}  // namespace dtr::calib::testing
