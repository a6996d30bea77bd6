#include "dtr/advise/places.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "dtr/types/area_average.h"

namespace dtr::advise {
namespace {

constexpr size_t kNeighbours = 3;
constexpr double kMaxTurn = std::numbers::pi / 3;  // as valid views, SPEC 1
constexpr int kPlaceSidePx = 96;

Eigen::Vector3d AxisOf(const Pose& cam_from_world) {
  return cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
}

Pose PoseAt(const Eigen::Vector3d& center, const Eigen::Quaterniond& cam_from_world) {
  return {cam_from_world, -(cam_from_world * center)};
}

PinholeCamera SmallCamera(const PinholeCamera& camera) {
  const auto [width, height] = TargetSize(camera.width_px(), camera.height_px(), kPlaceSidePx);
  return camera.Resized(width, height);
}

}  // namespace

std::vector<size_t> NearestViews(std::span<const CoarseView> views, const Pose& cam_from_world,
                                 size_t count) {
  const Eigen::Vector3d center = cam_from_world.TargetOriginInSource();
  const Eigen::Vector3d axis = AxisOf(cam_from_world);
  std::vector<std::pair<double, size_t>> near;
  for (size_t i = 0; i < views.size(); ++i) {
    const double cosine = axis.dot(AxisOf(views[i].cam_from_world));
    if (cosine < std::cos(kMaxTurn)) continue;
    near.emplace_back((views[i].CenterInWorld() - center).norm(), i);
  }
  std::sort(near.begin(), near.end());
  if (near.size() > count) near.resize(count);
  std::vector<size_t> indices;
  for (const auto& [distance, index] : near) indices.push_back(index);
  return indices;
}

std::vector<Place> PlacesAmong(std::span<const CoarseView> views,
                               const std::vector<std::string>& names) {
  const auto where = [&](const std::string& how, size_t i, const std::string& and_how, size_t j) {
    return names[i] == names[j] ? "near " + names[i] : how + names[i] + and_how + names[j];
  };
  std::vector<Place> places;
  std::set<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i < views.size(); ++i) {
    const CoarseView& view = views[i];
    bool nearest = true;
    for (const size_t j : NearestViews(views, view.cam_from_world, kNeighbours + 1)) {
      if (j == i) continue;
      const CoarseView& other = views[j];
      const Eigen::Vector3d step = view.CenterInWorld() - other.CenterInWorld();
      if (nearest && step.norm() > 0) {
        places.push_back({where("beyond ", i, ", away from ", j), SmallCamera(view.camera),
                          PoseAt(view.CenterInWorld() + step / 2, view.cam_from_world.rotation)});
        nearest = false;
      }
      if (!pairs.emplace(std::min(i, j), std::max(i, j)).second) continue;
      places.push_back(
          {where("between ", i, " and ", j), SmallCamera(view.camera),
           PoseAt((view.CenterInWorld() + other.CenterInWorld()) / 2,
                  view.cam_from_world.rotation.slerp(0.5, other.cam_from_world.rotation))});
    }
  }
  return places;
}

}  // namespace dtr::advise
