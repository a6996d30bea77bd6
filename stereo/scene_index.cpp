#include "stereo/scene_index.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dtr::stereo {

std::vector<std::vector<int>> PointsOfViews(const SparseScene& scene, size_t view_count) {
  std::vector<std::vector<int>> points(view_count);
  for (const SparseObservation& o : scene.observations) {
    if (o.view < 0 || static_cast<size_t>(o.view) >= view_count || o.point < 0 ||
        static_cast<size_t>(o.point) >= scene.points.size()) {
      throw std::invalid_argument("SparseScene: an observation names a missing view or point");
    }
    points[static_cast<size_t>(o.view)].push_back(o.point);
  }
  for (std::vector<int>& list : points) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return points;
}

std::vector<int> PointsInFrustum(const StereoView& view, const SparseScene& scene) {
  std::vector<int> inside;
  for (size_t i = 0; i < scene.points.size(); ++i) {
    const auto pixel = view.camera.PixelFromCam(view.cam_from_world * scene.points[i].p_in_world);
    if (pixel && view.camera.Contains(*pixel)) inside.push_back(static_cast<int>(i));
  }
  return inside;
}

double Quantile(std::vector<double> values, double q) {
  const double last = static_cast<double>(values.size() - 1);
  const auto rank = static_cast<std::ptrdiff_t>(std::lround(std::clamp(q, 0.0, 1.0) * last));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<size_t>(rank)];
}

}  // namespace dtr::stereo
