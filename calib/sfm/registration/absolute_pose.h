// calib/sfm/registration/absolute_pose.h -- internal to calib/sfm: a camera's pose from points
// whose positions are known.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "dtr/types/pose.h"

namespace dtr::sfm {

/// Points in the world and where a camera sees them: on the plane z = 1 of its frame, undistorted.
struct PointRays {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> rays;

  size_t size() const { return points.size(); }
  void Add(const Eigen::Vector3d& p_in_world, const Eigen::Vector2d& ray) {
    points.push_back(p_in_world);
    rays.push_back(ray);
  }
};

struct AbsolutePose {
  Pose cam_from_world;
  std::vector<int> inliers;  ///< indices of the points that agree, rising
};

/// The pose that most points agree with, to `limit` on the plane z = 1: P3P (Ke and Roumeliotis,
/// CVPR 2017; OpenCV's) within RANSAC. Empty where fewer than `min_inliers`, or four, do.
/// Deterministic.
std::optional<AbsolutePose> FindPose(const PointRays& seen, double limit, int min_inliers);

/// Least squares over all of `seen` (four or more) from a start: Levenberg-Marquardt, OpenCV's.
/// Empty where that diverges.
std::optional<Pose> RefineAbsolutePose(const PointRays& seen, const Pose& start);

}  // namespace dtr::sfm
