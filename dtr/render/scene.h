// dtr/render/scene.h -- what a renderer is given: source views and where the scene is.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/types/dtr_set.h"

namespace dtr {

/// The source views to draw from. The views must outlive the scene.
struct RenderScene {
  std::vector<const View*> views;  ///< in byte order of their ids; those drawn from are loaded
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< DtrSet::scene_center
  Bounds bounds;
  /// SPEC 1.3 decided beforehand, for one novel camera and from more views than these.
  std::optional<bool> per_pixel;
  /// What memory holds; K is at most this.
  std::optional<size_t> max_views;
};

/// SPEC 0.4. The source views of the set's only frame (AtFrame chooses it), without those whose id
/// or name is in `excluded_names`; held-out views are never among them. Views with the same camera,
/// pose, image, depth and mask count once (the first by id), so that a duplicate cannot pull the
/// blend. Throws dtr::UsageError when the set has several frames, and dtr::Error when it has none
/// or a source view is not loaded or has the wrong size, and dtr::UsageError for an excluded name
/// that no view has.
RenderScene MakeRenderScene(const DtrSet& set, std::span<const std::string> excluded_names = {});

/// The same scene of views that need no pixels yet: enough to choose views by (ViewsNeeded), whose
/// pixels are then loaded into `set`. The views must be distinct, as io::CollapseDuplicates leaves
/// them; without pixels nothing here can tell.
RenderScene DescribeRenderScene(const DtrSet& set,
                                std::span<const std::string> excluded_names = {});

/// Throws dtr::Error unless the view has an image and a plane-z depth map in memory, both (and a
/// mask, if any) of its camera's size, and a finite pose.
void RequireLoaded(const View& view);

/// SPEC 0.3. The baseline of every figure in pixels of disparity for this view, scene units: its
/// reference_baseline, or, for a view that has none (a lone camera), a tenth of its median depth.
double DisparityBaseline(const View& view);

/// Thresholds of one view as differences of inverse depth (1 / scene units), SPEC 0.3:
/// px / (fx * DisparityBaseline).
struct InverseDepthThresholds {
  double delta = 0;
  double depth_break = 0;
  double pixel = 0;           ///< one pixel of disparity
  double mesh_tolerance = 0;  ///< SPEC 5.1: of a reduced mesh
};
InverseDepthThresholds ThresholdsOf(const View& view, const RenderOptions& options);

}  // namespace dtr
