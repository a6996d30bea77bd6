// calib/sfm/mapping/pair_poses.h -- internal to calib/sfm/mapping: relative rotations of pairs, and
// how certain each is.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "calib/sfm/view_graph.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

/// Unit directions of every image's features in its camera's frame; zero where a camera has no ray
/// for a pixel.
using Rays = std::vector<std::vector<Eigen::Vector3d>>;

/// Rays of the graph's images through `cameras` (as ViewGraph::cameras). Features that no match
/// names get none, since they are not needed.
Rays RaysOf(const ViewGraph& graph, std::span<const calib::LensCamera> cameras);

/// A relative pose, as matches tell.
struct MatchedPose {
  Eigen::Matrix3d b_from_a = Eigen::Matrix3d::Identity();
  Eigen::Vector3d b_translation_a = Eigen::Vector3d::Zero();  ///< length 1, or 0: unknown
  /// Of a small rotation w in frame b, observed = exp(w) true; rad^2. Of pairs with little parallax
  /// rotation and translation explain nearly the same: they are uncertain in that direction alone.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// Rotation of a pair of images, as its matches tell.
struct RelativeRotation : MatchedPose {
  int pair = 0;  ///< index into ViewGraph::pairs
  int image_a = 0, image_b = 0;
  int matches = 0;
  /// Most matches of a pair often lie on one plane (a wall, a floor), which two poses explain
  /// alike; the few others, with what is found along wrong epipolar lines, may choose the wrong
  /// one. The other one, where there is one; only other pairs can tell.
  std::optional<MatchedPose> twin = {};

  /// Takes the twin in the place of the pose.
  void TakeTwin() { std::swap(static_cast<MatchedPose&>(*this), *twin); }
};

/// The rotation of every pair, in their order; empty where the matches give none. The graph's own
/// rotation is where a robust fit of the epipolar angles (Sampson's, on the unit sphere; Cauchy's
/// loss) starts. Pairs without one (kUncalibrated) start at the five-point algorithm (Nister
/// 2004; OpenCV's, with RANSAC). Twins are from the homography that explains half of the matches,
/// if one does. `sigma_rad` is what a feature's position is known to, per image. Throws Interrupted
/// where `progress` (null: nothing) asks to stop.
std::vector<std::optional<RelativeRotation>> RelativeRotationsOf(
    const ViewGraph& graph, const Rays& rays, std::span<const double> sigma_rad,
    const Progress* progress = nullptr);

/// Angle of a match to the epipolar geometry in rad, signed; `ray_a`, `ray_b` unit vectors.
double EpipolarAngle(const Eigen::Matrix3d& b_from_a, const Eigen::Vector3d& b_translation_a,
                     const Eigen::Vector3d& ray_a, const Eigen::Vector3d& ray_b);

/// Distances along both rays at which they come nearest, in units of the translation.
Eigen::Vector2d DepthsOf(const Eigen::Matrix3d& b_from_a, const Eigen::Vector3d& b_translation_a,
                         const Eigen::Vector3d& ray_a, const Eigen::Vector3d& ray_b);

}  // namespace dtr::sfm
