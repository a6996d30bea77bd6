// dtr/types/sparse_scene.h -- the sparse points behind a calibration.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace dtr {

/// A point seen by several views.
struct SparsePoint {
  Eigen::Vector3d p_in_world = Eigen::Vector3d::Zero();
};

/// View `view` (an index into the list the scene belongs to) sees point `point` at `pixel`, on the
/// undistorted grid of that view's PinholeCamera.
struct SparseObservation {
  int view = 0;
  int point = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// Points and observations in the world frame of the views they come with.
struct SparseScene {
  std::vector<SparsePoint> points;
  std::vector<SparseObservation> observations;  ///< sorted by (view, point)
};

/// The part of a scene that the views with `keep[view]` alone would know: their observations, and
/// of the points those that at least two of them see. Views keep their indices, points are
/// renumbered in their old order. This is what keeps held-out photos out of everything built from
/// points.
SparseScene RestrictToViews(const SparseScene& scene, const std::vector<bool>& keep);

}  // namespace dtr
