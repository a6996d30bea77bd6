#include "dtr/render/opening_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "dtr/base/order_statistics.h"
#include "dtr/render/geometry.h"

namespace dtr {

size_t OpeningView(std::span<const View* const> views, const Eigen::Vector3d& scene_center) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const View* view : views) along.push_back(view->CenterInWorld()[axis]);
    middle[axis] = UpperMedian(along);
  }
  std::vector<double> distances;
  for (const View* view : views) distances.push_back((view->CenterInWorld() - middle).norm());
  std::vector<double> sorted = distances;
  const double usual = std::max(UpperMedian(sorted), std::numeric_limits<double>::min());
  std::vector<double> costs;
  for (size_t i = 0; i < views.size(); ++i) {
    const Eigen::Vector3d in_cam = views[i]->cam_from_world * scene_center;
    costs.push_back(distances[i] / usual + std::atan2(in_cam.head<2>().norm(), in_cam.z()));
  }
  return static_cast<size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
}

double CameraSpan(std::span<const View* const> views, const Eigen::Vector3d& scene_center) {
  std::vector<Eigen::Vector3d> directions;
  for (const View* view : views) {
    const Eigen::Vector3d away = view->CenterInWorld() - scene_center;
    if (away.norm() > 0) directions.push_back(away.normalized());
  }
  if (directions.size() < 2) return 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& direction : directions) mean += direction;
  // Evenly around it, but for rounding: no direction to measure from.
  if (mean.norm() < 1e-6) return std::numbers::pi;
  std::vector<double> angles;
  for (const Eigen::Vector3d& direction : directions) {
    angles.push_back(AngleBetween(direction, mean));
  }
  const double usual = QuantileOf(angles, 0.9);
  // Between a wide arc of photos before a scene and a ring of them above an object.
  constexpr double kAround = 40 * std::numbers::pi / 180;
  return usual < kAround ? 2 * usual : std::numbers::pi;
}

}  // namespace dtr
