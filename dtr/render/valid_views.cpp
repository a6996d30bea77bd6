#include "dtr/render/valid_views.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "dtr/render/geometry.h"

namespace dtr {

bool NeedsPerPixelRule(const RenderScene& scene, const Pose& novel_from_world) {
  if (scene.per_pixel) return *scene.per_pixel;
  if (!((novel_from_world * scene.center).z() > 0)) return true;
  size_t seeing = 0;
  for (const View* view : scene.views) {
    const auto pixel = view->camera.PixelFromCam(view->cam_from_world * scene.center);
    if (pixel && view->camera.Contains(*pixel)) ++seeing;
  }
  return 2 * seeing <= scene.views.size();
}

ViewSelection SelectViews(const RenderScene& scene, const Pose& novel_from_world,
                          const RenderOptions& options) {
  ViewSelection selection;
  selection.per_pixel = NeedsPerPixelRule(scene, novel_from_world);
  const Eigen::Vector3d novel_center = novel_from_world.TargetOriginInSource();

  struct Candidate {
    double angle_rad, distance;
    int index;
  };
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    const Eigen::Vector3d center = scene.views[i]->CenterInWorld();
    // SPEC 1.1
    const double angle =
        selection.per_pixel ? 0 : AngleBetween(center - scene.center, novel_center - scene.center);
    if (!(angle <= options.max_angle_rad)) continue;
    candidates.push_back({angle, (center - novel_center).norm(), static_cast<int>(i)});
  }
  // SPEC 1.2: by angle, then by distance, then by id: the order of the input never decides.
  std::sort(candidates.begin(), candidates.end(), [&](const Candidate& a, const Candidate& b) {
    const std::string& id_a = scene.views[static_cast<size_t>(a.index)]->id;
    const std::string& id_b = scene.views[static_cast<size_t>(b.index)]->id;
    return std::tie(a.angle_rad, a.distance, id_a, a.index) <
           std::tie(b.angle_rad, b.distance, id_b, b.index);
  });
  if (!selection.per_pixel && candidates.size() > static_cast<size_t>(options.views)) {
    candidates.resize(static_cast<size_t>(options.views));
  }
  for (const Candidate& candidate : candidates) selection.views.push_back(candidate.index);
  return selection;
}

std::vector<int> ViewsNeeded(const RenderScene& scene, std::span<const Pose> novel_from_world,
                             const RenderOptions& options) {
  std::set<int> needed;
  for (const Pose& pose : novel_from_world) {
    const ViewSelection selection = SelectViews(scene, pose, options);
    needed.insert(selection.views.begin(), selection.views.end());
  }
  return {needed.begin(), needed.end()};
}

}  // namespace dtr
