// dtr/render/geometry.h -- where a scene is and how far apart its cameras stand, from the data.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"
#include "dtr/types/sparse_scene.h"

namespace dtr {

/// Angle in [0, pi] between two directions, by atan2(|a x b|, a . b): exact near 0 and pi, where
/// acos loses half its digits and can give NaN. 0 if a direction is the zero vector.
double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Abramowitz & Stegun, Handbook of Mathematical Functions, 4.4.49; highest power first.
inline constexpr double kQuickAngleSeries[] = {0.0028662257,  -0.0161657367, 0.0429096138,
                                               -0.0752896400, 0.1065626393,  -0.1420889944,
                                               0.1999355085,  -0.3333314528, 1};

/// The same angle from the length of the cross product (not negative) and the dot product, to
/// within 2e-8 rad and at a quarter of the cost: for weights, of which an image needs millions.
inline double QuickAngle(double cross_length, double dot) {
  const double side = std::abs(dot);
  const double longer = std::max(cross_length, side);
  if (!(longer > 0)) return 0;
  const double x = std::min(cross_length, side) / longer, q = x * x;
  double series = 0;
  for (const double coefficient : kQuickAngleSeries) series = coefficient + q * series;
  const double first_octant = x * series;
  const double first_quadrant =
      cross_length > side ? std::numbers::pi / 2 - first_octant : first_octant;
  return dot < 0 ? std::numbers::pi - first_quadrant : first_quadrant;
}

/// SPEC 0.3. For each camera the median distance (scene units) to its 4 nearest other cameras by
/// viewing angle at `scene_center` (ties: the smaller index); the median of what there is when
/// there are fewer; 0 for a single camera.
std::vector<double> ReferenceBaselines(std::span<const Pose> cam_from_world,
                                       const Eigen::Vector3d& scene_center);

/// The same for one camera among others that do not contain it.
double ReferenceBaseline(const Pose& cam_from_world, std::span<const Pose> others_from_world,
                         const Eigen::Vector3d& scene_center);

/// Where the scene is. World frame of the views or points it was made from.
struct SceneExtent {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< per-axis median
  Bounds bounds;                                     ///< per-axis 1 % to 99 % percentiles
};

/// SPEC 0.2, from the loaded depth of the source views (held-out views and holes are passed over),
/// sampled on a regular grid of at most 64x64 per view. Does not depend on the views' order.
/// Throws dtr::Error when no source view has a depth.
SceneExtent SceneExtentFromDepth(std::span<const View> views);

/// The same, view by view, for sets whose depth maps do not fit into memory together.
class DepthSamples {
 public:
  /// Adds the samples of a source view that has its depth loaded; passes over others.
  void Add(const View& view);
  bool empty() const { return coordinates_[0].empty(); }
  /// Throws dtr::Error when there is no sample.
  SceneExtent Extent() const;

 private:
  std::vector<double> coordinates_[3];
};

Eigen::Vector3d SceneCenterFromDepth(std::span<const View> views);

/// SPEC 0.2, from sparse points. Throws dtr::Error when there is no finite point.
SceneExtent SceneExtentFromPoints(std::span<const SparsePoint> points);
Eigen::Vector3d SceneCenterFromPoints(std::span<const SparsePoint> points);

/// Sets scene_center, bounds and every view's reference_baseline: the extent from the loaded depth
/// of the source views, or from `points` where no view has depth yet; baselines to source cameras
/// only, so that held-out views change nothing. Throws dtr::Error when there is neither.
void FinishGeometry(DtrSet& set, std::span<const SparsePoint> points = {});
/// The same from an extent that is known.
void FinishGeometry(DtrSet& set, const SceneExtent& extent);

}  // namespace dtr
