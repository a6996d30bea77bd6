#include "dtr/render/geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/render/nearest_by_angle.h"

namespace dtr {
namespace {

constexpr int kSamplesPerAxis = 64;      // 4096 points a view place a median to a percent or two
constexpr double kLowPercentile = 0.01;  // beyond lie stray points of stereo and SfM
constexpr double kHighPercentile = 0.99;

/// Middle value, or the mean of the two middle ones.
double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

double MedianDistance(const Eigen::Vector3d& center, const std::vector<Eigen::Vector3d>& others) {
  if (others.empty()) return 0;
  std::vector<double> distances;
  for (const Eigen::Vector3d& other : others) distances.push_back((center - other).norm());
  return Median(std::move(distances));
}

SceneExtent ExtentOf(std::vector<double> (&coordinates)[3]) {
  SceneExtent extent;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double>& values = coordinates[axis];
    extent.center[axis] = QuantileOf(values, 0.5);
    extent.bounds.min[axis] = QuantileOf(values, kLowPercentile);
    extent.bounds.max[axis] = QuantileOf(values, kHighPercentile);
  }
  return extent;
}

bool HasDepth(const View& view) { return view.role == ViewRole::kSource && !view.depth.empty(); }

void AppendPoints(const View& view, std::vector<double> (&coordinates)[3]) {
  const PinholeCamera camera = view.DepthCamera();
  if (view.depth.width() != camera.width_px() || view.depth.height() != camera.height_px()) {
    throw Error(view.name + ": the depth map must have the image's size divided by depth.scale (" +
                std::to_string(camera.width_px()) + "x" + std::to_string(camera.height_px()) +
                "), found " + std::to_string(view.depth.width()) + "x" +
                std::to_string(view.depth.height()));
  }
  const Pose world_from_cam = view.cam_from_world.Inverse();
  const int step_x = (view.depth.width() + kSamplesPerAxis - 1) / kSamplesPerAxis;
  const int step_y = (view.depth.height() + kSamplesPerAxis - 1) / kSamplesPerAxis;
  for (int y = step_y / 2; y < view.depth.height(); y += step_y) {
    for (int x = step_x / 2; x < view.depth.width(); x += step_x) {
      const float depth = view.depth(x, y);
      if (DepthImage::IsHole(depth)) continue;
      const Eigen::Vector3d point =
          world_from_cam * camera.CamFromPixel({x + 0.5, y + 0.5}, depth, view.depth.kind());
      for (int axis = 0; axis < 3; ++axis) coordinates[axis].push_back(point[axis]);
    }
  }
}

}  // namespace

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

double ReferenceBaseline(const Pose& cam_from_world, std::span<const Pose> others_from_world,
                         const Eigen::Vector3d& scene_center) {
  const Eigen::Vector3d center = cam_from_world.TargetOriginInSource();
  return MedianDistance(center, NearestByAngle(others_from_world, scene_center).Of(center, {}));
}

std::vector<double> ReferenceBaselines(std::span<const Pose> cam_from_world,
                                       const Eigen::Vector3d& scene_center) {
  const NearestByAngle nearest(cam_from_world, scene_center);
  std::vector<double> baselines;
  for (size_t i = 0; i < cam_from_world.size(); ++i) {
    const Eigen::Vector3d center = cam_from_world[i].TargetOriginInSource();
    baselines.push_back(MedianDistance(center, nearest.Of(center, i)));
  }
  return baselines;
}

void DepthSamples::Add(const View& view) {
  if (HasDepth(view)) AppendPoints(view, coordinates_);
}

void DepthSamples::Append(const DepthSamples& more) {
  for (int axis = 0; axis < 3; ++axis) {
    coordinates_[axis].insert(coordinates_[axis].end(), more.coordinates_[axis].begin(),
                              more.coordinates_[axis].end());
  }
}

SceneExtent DepthSamples::Extent() const {
  if (empty()) {
    throw Error(
        "scene extent: expected source views with depth, found no depth sample; "
        "run `dtr stereo` or give sparse points");
  }
  std::vector<double> coordinates[3] = {coordinates_[0], coordinates_[1], coordinates_[2]};
  return ExtentOf(coordinates);
}

SceneExtent SceneExtentFromDepth(std::span<const View> views) {
  DepthSamples samples;
  for (const View& view : views) samples.Add(view);
  return samples.Extent();
}

Eigen::Vector3d SceneCenterFromDepth(std::span<const View> views) {
  return SceneExtentFromDepth(views).center;
}

SceneExtent SceneExtentFromPoints(std::span<const SparsePoint> points) {
  std::vector<double> coordinates[3];
  for (const SparsePoint& point : points) {
    if (!point.p_in_world.allFinite()) continue;
    for (int axis = 0; axis < 3; ++axis) coordinates[axis].push_back(point.p_in_world[axis]);
  }
  if (coordinates[0].empty()) {
    throw Error("scene extent: expected sparse points, found none that is finite");
  }
  return ExtentOf(coordinates);
}

Eigen::Vector3d SceneCenterFromPoints(std::span<const SparsePoint> points) {
  return SceneExtentFromPoints(points).center;
}

void FinishGeometry(DtrSet& set, std::span<const SparsePoint> points) {
  if (set.frames.empty()) throw Error("set: expected at least one frame, found none");
  std::vector<View>& views = set.frames.front().views;
  const bool has_depth = std::any_of(views.begin(), views.end(), HasDepth);
  FinishGeometry(set, has_depth || points.empty() ? SceneExtentFromDepth(views)
                                                  : SceneExtentFromPoints(points));
}

void FinishGeometry(DtrSet& set, const SceneExtent& extent) {
  set.scene_center = extent.center;
  set.bounds = extent.bounds;
  for (Frame& frame : set.frames) {
    std::vector<Pose> sources;
    for (const View& view : frame.views) {
      if (view.role == ViewRole::kSource) sources.push_back(view.cam_from_world);
    }
    const NearestByAngle nearest(sources, set.scene_center);
    size_t source = 0;
    for (View& view : frame.views) {
      std::optional<size_t> self;
      if (view.role == ViewRole::kSource) self = source++;
      const Eigen::Vector3d center = view.CenterInWorld();
      view.reference_baseline = MedianDistance(center, nearest.Of(center, self));
    }
  }
}

}  // namespace dtr
