#include "dtr/render/scene.h"

#include <algorithm>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/size_text.h"
#include "dtr/render/time_steps.h"
#include "dtr/types/distinct_views.h"

namespace dtr {
namespace {

// A photographer with one neighbour stands about this share of the distance away; only sets of a
// single camera need it, where no pair of photos defines a disparity.
constexpr double kLoneCameraBaseline = 0.1;

void RequireSize(const View& view, const char* what, int width_px, int height_px,
                 const PinholeCamera& expected) {
  if (width_px == expected.width_px() && height_px == expected.height_px()) return;
  throw Error(view.name + ": expected a loaded " + what + " of " +
              SizeText(expected.width_px(), expected.height_px()) + " pixels, found " +
              (width_px == 0 ? "none" : SizeText(width_px, height_px)));
}

bool SameContent(const View& a, const View& b) {
  return a.camera == b.camera && a.cam_from_world.translation == b.cam_from_world.translation &&
         a.cam_from_world.rotation.coeffs() == b.cam_from_world.rotation.coeffs() &&
         a.gain == b.gain && a.depth == b.depth && a.image == b.image && a.mask == b.mask;
}

}  // namespace

void RequireLoaded(const View& view) {
  RequireSize(view, "image", view.image.width(), view.image.height(), view.camera);
  if (view.image.channels() != 3) throw Error(view.name + ": expected an image of 3 channels");
  RequireSize(view, "depth map", view.depth.width(), view.depth.height(), view.DepthCamera());
  if (view.depth.kind() != DepthKind::kPlaneZ) {
    throw Error(view.name + ": expected plane-z depth, found ray distances; convert at import");
  }
  if (!view.mask.empty()) {
    RequireSize(view, "mask", view.mask.width(), view.mask.height(), view.camera);
  }
  if (!view.cam_from_world.translation.allFinite() ||
      !view.cam_from_world.rotation.coeffs().allFinite()) {
    throw Error(view.name + ": the pose is not finite");
  }
}

RenderScene DescribeRenderScene(const DtrSet& set, std::span<const std::string> excluded_names) {
  RequireOneFrame(set);
  const std::vector<View>& views = set.frames.front().views;
  std::set<std::string> excluded(excluded_names.begin(), excluded_names.end()), unknown = excluded;
  for (const View& view : views) {
    if (unknown.empty()) break;
    unknown.erase(view.id);
    unknown.erase(view.name);
  }
  for (const std::string& name : excluded_names) {
    if (!unknown.contains(name)) continue;
    throw UsageError("`exclude`: expected the name of a view, found '" + name +
                     "'; `dtr info` lists the names");
  }
  RenderScene scene;
  scene.center = set.scene_center;
  scene.bounds = set.bounds;
  for (const View& view : views) {
    if (view.role != ViewRole::kSource) continue;
    if (excluded.contains(view.id) || excluded.contains(view.name)) continue;
    scene.views.push_back(&view);
  }
  std::stable_sort(scene.views.begin(), scene.views.end(),
                   [](const View* a, const View* b) { return a->id < b->id; });
  return scene;
}

RenderScene MakeRenderScene(const DtrSet& set, std::span<const std::string> excluded_names) {
  RenderScene scene = DescribeRenderScene(set, excluded_names);
  for (const View* view : scene.views) RequireLoaded(*view);
  const auto none = [](const View&) { return std::string(); };
  std::vector<const View*> distinct;
  for (const size_t i : DistinctViews(scene.views, none, SameContent)) {
    distinct.push_back(scene.views[i]);
  }
  scene.views = std::move(distinct);
  return scene;
}

double DisparityBaseline(const View& view) {
  if (view.reference_baseline > 0) return view.reference_baseline;
  std::vector<float> depths;
  for (const float depth : view.depth.grid().data()) {
    if (!DepthImage::IsHole(depth)) depths.push_back(depth);
  }
  if (depths.empty()) return 1;  // nothing will be drawn; any positive number does
  return kLoneCameraBaseline * static_cast<double>(UpperMedian(depths));
}

InverseDepthThresholds ThresholdsOf(const View& view, const RenderOptions& options) {
  const double inverse_depth_per_px = 1 / (view.camera.fx_px() * DisparityBaseline(view));
  return {options.delta_px * inverse_depth_per_px, options.depth_break_px * inverse_depth_per_px,
          inverse_depth_per_px, options.mesh_tolerance_px * inverse_depth_per_px};
}

}  // namespace dtr
