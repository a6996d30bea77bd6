// dtr/render/geometry.h -- where a scene is and how far apart its cameras stand, from the data.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"
#include "dtr/types/sparse_scene.h"

namespace dtr {

/// Angle in [0, pi] between two directions, by atan2(|a x b|, a . b): exact near 0 and pi, where
/// acos loses half its digits and can give NaN. 0 if a direction is the zero vector.
double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

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
  void Append(const DepthSamples& more);
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
