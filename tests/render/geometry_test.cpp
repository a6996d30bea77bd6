#include "dtr/render/geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "dtr/base/error.h"
#include "dtr/base/random.h"

namespace dtr {
namespace {

Pose LookingAlongZFrom(const Eigen::Vector3d& center) {
  return {Eigen::Quaterniond::Identity(), -center};
}

/// A view of the plane z = 10 of the world, from `center`, looking along +z.
View PlaneView(const std::string& name, const Eigen::Vector3d& center, int scale = 1) {
  View view;
  view.name = view.id = name;
  view.camera = PinholeCamera(64, 48, 50, 50, 32, 24);
  view.cam_from_world = LookingAlongZFrom(center);
  view.depth_scale = scale;
  view.depth = DepthImage(64 / scale, 48 / scale);
  for (float& z : view.depth.grid().data()) z = static_cast<float>(10 - center.z());
  return view;
}

TEST(AngleBetween, IsExactNearZeroAndPi) {
  const Eigen::Vector3d a(1, 0, 0);
  EXPECT_DOUBLE_EQ(AngleBetween(a, Eigen::Vector3d(1, 1e-9, 0)), 1e-9);
  EXPECT_DOUBLE_EQ(AngleBetween(a, -3 * a), std::numbers::pi);
  EXPECT_EQ(AngleBetween(a, 1e200 * a), 0);
  EXPECT_EQ(AngleBetween(a, Eigen::Vector3d::Zero()), 0);
}

TEST(ReferenceBaselines, MedianOfTheFourNearestByAngle) {
  // On a line 10 from the centre: angles rise with distance. From x = 0 the four nearest stand at
  // 1, 2, 3, 5; the median of those distances is 2.5. The fifth, at 100, does not count.
  std::vector<Pose> poses;
  for (const double x : {0.0, 1.0, 2.0, 3.0, 5.0, 100.0}) {
    poses.push_back(LookingAlongZFrom({x, 0, 0}));
  }
  const std::vector<double> baselines = ReferenceBaselines(poses, {0, 0, 10});
  EXPECT_DOUBLE_EQ(baselines[0], 2.5);
  EXPECT_DOUBLE_EQ(baselines[2], 1.5);  // 2, 1, 1, 3
}

TEST(ReferenceBaselines, NearestIsByAngleNotByDistance) {
  // Straight behind the first camera (angle 0, distance 30) comes before a neighbour at its side.
  const std::vector<Pose> poses = {LookingAlongZFrom({0, 0, 0}), LookingAlongZFrom({0, 0, -30}),
                                   LookingAlongZFrom({1, 0, 0}), LookingAlongZFrom({2, 0, 0}),
                                   LookingAlongZFrom({3, 0, 0}), LookingAlongZFrom({4, 0, 0})};
  EXPECT_DOUBLE_EQ(ReferenceBaselines(poses, {0, 0, 10})[0], 2.5);  // of 30, 1, 2, 3
}

TEST(ReferenceBaselines, AreThoseOfAPlainSearch) {
  const Eigen::Vector3d scene_center(1, 2, 3);
  Random random(7);
  std::vector<Pose> poses;
  for (int i = 0; i < 600; ++i) {
    const auto coordinate = [&] { return random.Uniform(-5, 5); };
    Eigen::Vector3d offset(coordinate(), coordinate(), i % 2 == 0 ? 0 : coordinate());
    if (i % 10 == 0) offset *= 0;                        // at the scene centre
    if (i % 10 == 1) offset = {0, 0, 1.0 + i % 7};       // one direction, with equal positions
    if (i % 10 == 2) offset = {1e-15, 0, coordinate()};  // nearly one
    poses.push_back(LookingAlongZFrom(scene_center + offset));
  }
  const std::vector<double> baselines = ReferenceBaselines(poses, scene_center);
  for (size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d here = poses[i].TargetOriginInSource();
    std::vector<std::tuple<double, size_t, double>> others;  // by angle, then index
    for (size_t j = 0; j < poses.size(); ++j) {
      const Eigen::Vector3d there = poses[j].TargetOriginInSource();
      if (j != i) {
        others.emplace_back(AngleBetween(here - scene_center, there - scene_center), j,
                            (here - there).norm());
      }
    }
    std::sort(others.begin(), others.end());
    std::vector<double> distances;
    for (size_t k = 0; k < 4; ++k) distances.push_back(std::get<2>(others[k]));
    std::sort(distances.begin(), distances.end());
    EXPECT_EQ(baselines[i], 0.5 * (distances[1] + distances[2])) << i;
  }
}

TEST(ReferenceBaselines, FewCameras) {
  EXPECT_EQ(ReferenceBaselines(std::vector<Pose>{}, {0, 0, 1}).size(), 0u);
  EXPECT_EQ(ReferenceBaselines(std::vector<Pose>(1), {0, 0, 1}), std::vector<double>{0});
  const std::vector<Pose> two = {LookingAlongZFrom({0, 0, 0}), LookingAlongZFrom({3, 4, 0})};
  EXPECT_EQ(ReferenceBaselines(two, {0, 0, 10}), (std::vector<double>{5, 5}));
}

TEST(SceneExtent, PlaneHasItsCentreOnThePlane) {
  for (const int scale : {1, 2}) {
    const std::vector<View> views = {PlaneView("a", {-1, 0, 0}, scale),
                                     PlaneView("b", {1, 0, 2}, scale)};
    const SceneExtent extent = SceneExtentFromDepth(views);
    EXPECT_NEAR(extent.center.x(), 0, 0.5);
    EXPECT_NEAR(extent.center.y(), 0, 0.5);
    EXPECT_NEAR(extent.center.z(), 10, 1e-6);  // float depth
    EXPECT_LT(extent.bounds.min.x(), -4);
    EXPECT_GT(extent.bounds.max.x(), 4);
    EXPECT_FALSE(extent.bounds.empty());
  }
}

TEST(SceneExtent, DoesNotDependOnTheOrderAndPassesOverHeldOutViewsAndHoles) {
  std::vector<View> views = {PlaneView("a", {-1, 0, 0}), PlaneView("b", {1, 0, 0}),
                             PlaneView("c", {500, 0, 0})};
  views[2].role = ViewRole::kHeldOut;
  views[0].depth(10, 10) = 0;
  views[0].depth(11, 11) = std::nanf("");
  const SceneExtent forward = SceneExtentFromDepth(views);
  std::swap(views[0], views[1]);
  const SceneExtent swapped = SceneExtentFromDepth(views);
  EXPECT_EQ(forward.center, swapped.center);
  EXPECT_EQ(forward.bounds.min, swapped.bounds.min);
  EXPECT_LT(forward.bounds.max.x(), 20);
}

TEST(SceneExtent, StrayPointsDoNotMoveIt) {
  std::vector<SparsePoint> points;
  for (int i = 0; i < 1000; ++i) points.push_back({{i % 10 + 0.5, i / 100 + 0.5, 7}});
  for (int i = 0; i < 5; ++i) points.push_back({{1e9, -1e9, 1e9}});
  points.push_back({{std::nan(""), 0, 0}});
  const SceneExtent extent = SceneExtentFromPoints(points);
  EXPECT_NEAR(extent.center.x(), 5, 1);
  EXPECT_NEAR(extent.center.z(), 7, 0);
  EXPECT_LE(extent.bounds.max.x(), 10);
}

TEST(SceneExtent, NothingToMeasureIsAnError) {
  std::vector<View> views(2);
  EXPECT_THROW(SceneExtentFromDepth(views), Error);
  EXPECT_THROW(SceneExtentFromPoints({}), Error);
  views = {PlaneView("a", {0, 0, 0})};
  views[0].depth = DepthImage(63, 48);
  EXPECT_THROW(SceneExtentFromDepth(views), Error);
}

TEST(FinishGeometry, HeldOutViewsChangeNothingOfTheSources) {
  DtrSet set;
  set.frames.resize(1);
  for (int i = 0; i < 6; ++i) {
    set.frames[0].views.push_back(PlaneView("v" + std::to_string(i), {1.0 * i, 0, 0}));
  }
  DtrSet without = set;
  without.frames[0].views.pop_back();
  set.frames[0].views[5].role = ViewRole::kHeldOut;
  FinishGeometry(set);
  FinishGeometry(without);
  EXPECT_EQ(set.scene_center, without.scene_center);
  EXPECT_EQ(set.bounds.max, without.bounds.max);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(set.frames[0].views[i].reference_baseline,
              without.frames[0].views[i].reference_baseline);
    EXPECT_GT(set.frames[0].views[i].reference_baseline, 0);
  }
  EXPECT_DOUBLE_EQ(set.frames[0].views[5].reference_baseline, 2.5);
}

TEST(FinishGeometry, WithoutDepthTheSparsePointsPlaceTheScene) {
  DtrSet set;
  set.frames.resize(1);
  set.frames[0].views = {PlaneView("a", {0, 0, 0}), PlaneView("b", {2, 0, 0})};
  for (View& view : set.frames[0].views) view.depth = DepthImage();
  EXPECT_THROW(FinishGeometry(set), Error);
  const std::vector<SparsePoint> points = {{{1, 2, 3}}};
  FinishGeometry(set, points);
  EXPECT_EQ(set.scene_center, Eigen::Vector3d(1, 2, 3));
  EXPECT_DOUBLE_EQ(set.frames[0].views[0].reference_baseline, 2);
}

}  // namespace
}  // namespace dtr
