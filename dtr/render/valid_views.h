// dtr/render/valid_views.h -- SPEC 1: which views may show something of a novel view.
#pragma once
#include <span>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/scene.h"

namespace dtr {

/// Outcome of SPEC 1.
struct ViewSelection {
  /// Indices into RenderScene::views. Sphere rule: the K nearest by angle at the scene centre,
  /// nearest first. Per-pixel rule: every view, by the distance of its centre.
  std::vector<int> views;
  /// True where the angle at the scene centre says nothing (SPEC 1.3): then renderers apply
  /// max_angle and K per pixel, at the 3D point (views tied with the K-th stay).
  bool per_pixel = false;
  /// Sphere rule: the angles of `views` at the scene centre, and that of the nearest valid view
  /// that is not among them, `max_angle_rad` where there is none.
  std::vector<double> angles_rad;
  double next_angle_rad = 0;
};

/// SPEC 1.4. What a view at angle a keeps of its weight where views beyond `cut_rad` count nothing.
double CutFactor(double angle_rad, double cut_rad);

/// SPEC 1.4 for the first `count` of the selection's views, as if K were `count`; with the
/// per-pixel rule all are 1, for there angles at the point decide.
std::vector<double> CutFactors(const ViewSelection& selection, size_t count);

/// SPEC 1.3: true when the sphere rule cannot hold: the novel camera does not have the scene
/// centre in front of it, or no more than half of the views have it inside their image.
bool NeedsPerPixelRule(const RenderScene& scene, const Pose& novel_from_world);

/// SPEC 1. Ties go to the smaller id. Empty when no view is valid.
ViewSelection SelectViews(const RenderScene& scene, const Pose& novel_from_world,
                          const RenderOptions& options);

/// Indices, ascending, of the views that images from all these cameras draw from: what must be
/// loaded. Needs no pixels (DescribeRenderScene).
std::vector<int> ViewsNeeded(const RenderScene& scene, std::span<const Pose> novel_from_world,
                             const RenderOptions& options);

}  // namespace dtr
