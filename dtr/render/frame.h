// dtr/render/frame.h -- the parts of drawing one image that every renderer has in common.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr {

/// Throws dtr::UsageError for images beyond 2^28 pixels and dtr::Error for a pose that is not
/// finite or has no rotation.
void CheckNovelCamera(const PinholeCamera& novel, const Pose& novel_from_world);

/// All grids of the novel camera's size: black, no depth, nothing seen.
RenderResult EmptyResult(const PinholeCamera& novel);

/// Share of pixels seen.
double CoverageShare(const Mask& coverage);

/// A view as seen from the novel camera.
struct ViewPlacement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< novel_from_view
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< also the view's centre in novel
  double near_z = 0;  ///< triangles are cut here, SPEC 2.5; scene units
};

/// SPEC 0.5: from the difference of the centres, so that the world's offset cancels before anything
/// is multiplied.
ViewPlacement PlaceView(const View& view, const Pose& novel_from_world);

/// SPEC 4.7: `views`, indices into the scene, in the order in which sums run: that of the ids.
std::vector<int> CanonicalOrder(const RenderScene& scene, std::vector<int> views);

}  // namespace dtr
