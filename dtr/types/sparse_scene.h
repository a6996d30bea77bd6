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

}  // namespace dtr
