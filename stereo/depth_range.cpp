#include "stereo/depth_range.h"

#include <string>

#include "dtr/base/error.h"
#include "stereo/scene_index.h"

namespace dtr::stereo {
namespace {

/// Inverse z of those of the points that lie in front of the view.
std::vector<double> InverseDepths(const StereoView& view, const SparseScene& scene,
                                  const std::vector<int>& points) {
  std::vector<double> inverse_depths;
  inverse_depths.reserve(points.size());
  for (const int i : points) {
    const double z = (view.cam_from_world * scene.points[static_cast<size_t>(i)].p_in_world).z();
    if (z > 0) inverse_depths.push_back(1.0 / z);
  }
  return inverse_depths;
}

}  // namespace

std::vector<DepthRange> DepthRangesFromPoints(std::span<const StereoView> views,
                                              const SparseScene& scene,
                                              const DepthRangeOptions& options) {
  const std::vector<std::vector<int>> observed = PointsOfViews(scene, views.size());
  const size_t needed = static_cast<size_t>(std::max(1, options.min_points));
  std::vector<DepthRange> ranges;
  for (size_t v = 0; v < views.size(); ++v) {
    std::vector<double> inverse_depths = InverseDepths(views[v], scene, observed[v]);
    if (inverse_depths.size() < needed) {
      inverse_depths = InverseDepths(views[v], scene, PointsInFrustum(views[v], scene));
    }
    if (inverse_depths.size() < needed) {
      const std::string who = v < options.names.size() ? options.names[v] : std::to_string(v);
      throw Error("view " + who + ": expected at least " + std::to_string(needed) +
                  " sparse points in view, which give its depth range, found " +
                  std::to_string(inverse_depths.size()) +
                  "; take more photos of what it shows, or leave it out");
    }
    const double cut = options.percentile / 100.0;
    ranges.push_back({.near_z = 1.0 / (Quantile(inverse_depths, 1.0 - cut) * options.near_margin),
                      .far_z = options.far_margin / Quantile(inverse_depths, cut)});
  }
  return ranges;
}

}  // namespace dtr::stereo
