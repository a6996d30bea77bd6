#include "dtr/render/valid_views.h"

#include <algorithm>
#include <set>
#include <tuple>

#include "dtr/render/geometry.h"

namespace dtr {
namespace {

// SPEC 1.4: factors fall over this share of the cut's angle, and never to 0.
constexpr double kFallingShare = 0.25, kMinFactor = 1.0 / 255;

}  // namespace

double CutFactor(double angle_rad, double cut_rad) {
  if (!(cut_rad > 0)) return 1;
  return std::clamp((cut_rad - angle_rad) / (kFallingShare * cut_rad), kMinFactor, 1.0);
}

std::vector<double> CutFactors(const ViewSelection& selection, size_t count) {
  std::vector<double> factors(count, 1.0);
  if (selection.per_pixel) return factors;
  const double cut_rad =
      count < selection.angles_rad.size() ? selection.angles_rad[count] : selection.next_angle_rad;
  for (size_t i = 0; i < count; ++i) factors[i] = CutFactor(selection.angles_rad[i], cut_rad);
  return factors;
}

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
  const auto before = [&](const Candidate& a, const Candidate& b) {
    const std::string& id_a = scene.views[static_cast<size_t>(a.index)]->id;
    const std::string& id_b = scene.views[static_cast<size_t>(b.index)]->id;
    return std::tie(a.angle_rad, a.distance, id_a, a.index) <
           std::tie(b.angle_rad, b.distance, id_b, b.index);
  };
  selection.next_angle_rad = options.max_angle_rad;
  const size_t most =
      std::min(static_cast<size_t>(options.views), scene.max_views.value_or(candidates.size()));
  const bool cut = !selection.per_pixel && candidates.size() > most;
  const auto sorted = static_cast<std::ptrdiff_t>(cut ? most + 1 : candidates.size());
  std::partial_sort(candidates.begin(), candidates.begin() + sorted, candidates.end(), before);
  if (cut) {
    selection.next_angle_rad = candidates[most].angle_rad;
    candidates.resize(most);
  }
  for (const Candidate& candidate : candidates) {
    selection.views.push_back(candidate.index);
    selection.angles_rad.push_back(candidate.angle_rad);
  }
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
