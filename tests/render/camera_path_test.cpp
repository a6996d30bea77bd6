#include "dtr/render/camera_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "datasets/exact/analytic_scene.h"
#include "dtr/base/error.h"
#include "dtr/render/geometry.h"

namespace dtr {
namespace {

using namespace dtr::testing;

/// Cameras on an arc of radius 10 around the origin, in shuffled order.
DtrSet Arc(int count) {
  DtrSet set;
  set.frames.resize(1);
  for (int k = 0; k < count; ++k) {
    const int i = (k * 7) % count;  // 7 does not divide the counts below
    const double angle = 1.2 * i / count;
    View view;
    view.id = "v" + std::to_string(100 + i);
    view.camera = PinholeCamera(64, 48, 60, 60, 32, 24);
    view.cam_from_world = LookAt({10 * std::sin(angle), 0, -10 * std::cos(angle)}, {0, 0, 0});
    set.frames[0].views.push_back(view);
  }
  return set;
}

TEST(FlyThrough, RunsEvenlyFromOneEndToTheOtherAndKeepsLooking) {
  const DtrSet set = Arc(16);
  const std::vector<NovelCamera> path = FlyThrough(set, 60);
  ASSERT_EQ(path.size(), 60u);
  const double length = 1.2 * 15 / 16 * 10;
  EXPECT_NEAR((path.front().cam_from_world.TargetOriginInSource() -
               path.back().cam_from_world.TargetOriginInSource())
                  .norm(),
              20 * std::sin(length / 20), 1e-9);
  double shortest = 1e9, longest = 0;
  for (size_t i = 0; i < path.size(); ++i) {
    const Eigen::Vector3d center = path[i].cam_from_world.TargetOriginInSource();
    EXPECT_NEAR(center.norm(), 10, 0.05);
    const Eigen::Vector3d origin = path[i].cam_from_world * Eigen::Vector3d::Zero();
    EXPECT_LT(AngleBetween(origin, {0, 0, 1}), 0.01);
    EXPECT_NEAR(path[i].cam_from_world.rotation.norm(), 1, 1e-12);
    if (i == 0) continue;
    const double step = (center - path[i - 1].cam_from_world.TargetOriginInSource()).norm();
    shortest = std::min(shortest, step);
    longest = std::max(longest, step);
  }
  EXPECT_LT(longest, 1.05 * shortest);
}

TEST(FlyThrough, DoesNotDependOnTheOrderOfTheViewsAndPassesOverHeldOut) {
  DtrSet set = Arc(9);
  const std::vector<NovelCamera> path = FlyThrough(set, 20);
  std::reverse(set.frames[0].views.begin(), set.frames[0].views.end());
  View far;
  far.id = "a";
  far.role = ViewRole::kHeldOut;
  far.cam_from_world.translation = {500, 0, 0};
  set.frames[0].views.push_back(far);
  const std::vector<NovelCamera> again = FlyThrough(set, 20);
  for (size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ(path[i].cam_from_world.translation, again[i].cam_from_world.translation);
    EXPECT_EQ(path[i].cam_from_world.rotation.coeffs(), again[i].cam_from_world.rotation.coeffs());
  }
}

TEST(FlyThrough, OfVeryManyViewsStillRunsFromOneEndToTheOther) {
  const std::vector<NovelCamera> path = FlyThrough(Arc(20'000), 30);
  const double length = 1.2 * 10;
  // Ends that were thinned out lie some steps of 0.0006 away.
  EXPECT_NEAR((path.front().cam_from_world.TargetOriginInSource() -
               path.back().cam_from_world.TargetOriginInSource())
                  .norm(),
              20 * std::sin(length / 20), 0.02);
  for (const NovelCamera& camera : path) {
    EXPECT_NEAR(camera.cam_from_world.TargetOriginInSource().norm(), 10, 0.05);
  }
}

/// A view from `center` to the origin of what a ball there and a wall behind it look like.
View ViewOfABall(const std::string& id, const Eigen::Vector3d& center, double radius) {
  View view;
  view.id = id;
  view.camera = PinholeCamera(64, 48, 60, 60, 32, 24);
  view.cam_from_world = LookAt(center, {0, 0, 0});
  view.depth = DepthImage(64, 48);
  const double distance = center.norm();
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const Eigen::Vector3d ray = view.camera.RayFromPixel({x + 0.5, y + 0.5}).normalized();
      const double middle =
          ray.z() * distance;  // along the ray to where it is nearest to the origin
      const double half = radius * radius - distance * distance + middle * middle;
      const double along = half > 0 ? middle - std::sqrt(half) : 40 / ray.z();
      view.depth(x, y) = static_cast<float>(along * ray.z());
    }
  }
  return view;
}

DtrSet Around(const std::vector<double>& angles, double radius) {
  DtrSet set;
  set.frames.resize(1);
  for (const double angle : angles) {
    set.frames[0].views.push_back(
        ViewOfABall("v" + std::to_string(100 + set.frames[0].views.size()),
                    {10 * std::sin(angle), 0, -10 * std::cos(angle)}, radius));
  }
  return set;
}

TEST(FlyThrough, DoesNotPassThroughASurface) {
  // Five cameras before a ball and three behind it: the chain leads from these to those through it.
  DtrSet set = Around({-0.4, -0.2, 0, 0.2, 0.4, 3.0, 3.14, 3.28}, 3);
  for (const NovelCamera& camera : FlyThrough(set, 40)) {
    EXPECT_LT(camera.cam_from_world.TargetOriginInSource().z(), -9);
  }
  // The same by what a loader reads.
  std::map<std::string, DepthImage> stored;
  for (View& view : set.frames[0].views) stored[view.id] = std::exchange(view.depth, {});
  for (const NovelCamera& camera :
       FlyThrough(set, 40, [&](View& view) { view.depth = stored.at(view.id); })) {
    EXPECT_LT(camera.cam_from_world.TargetOriginInSource().z(), -9);
  }
  double farthest_z = -10;
  for (const NovelCamera& camera : FlyThrough(set, 40)) {
    farthest_z = std::max(farthest_z, camera.cam_from_world.TargetOriginInSource().z());
  }
  EXPECT_GT(farthest_z, 9) << "without depth nothing is known of the ball";
}

TEST(FlyThrough, TakesMoreKeysWhereFewerWouldCutThroughASurface) {
  std::vector<double> ring;
  for (int i = 0; i < 100; ++i) ring.push_back(2 * M_PI * i / 100);
  const auto least_norm = [](const DtrSet& set) {
    double least = 10;
    for (const NovelCamera& camera : FlyThrough(set, 200)) {
      least = std::min(least, camera.cam_from_world.TargetOriginInSource().norm());
    }
    return least;
  };
  EXPECT_LT(least_norm(Around(ring, 3)), 9.3) << "eight keys cut corners, where there is room";
  EXPECT_GT(least_norm(Around(ring, 9.4)), 10 - 2 * M_PI * 10 / 100);
}

TEST(FlyThrough, IsSlowerWhereTheSceneIsNearer) {
  DtrSet set;
  set.frames.resize(1);
  for (int i = 0; i < 8; ++i) {
    View view = ViewOfABall("v" + std::to_string(i), {static_cast<double>(i), 0, -10}, 0);
    view.cam_from_world = {Eigen::Quaterniond::Identity(), {-static_cast<double>(i), 0, 10}};
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 64; ++x) view.depth(x, y) = i < 4 ? 2 : 8;
    }
    set.frames[0].views.push_back(view);
  }
  const std::vector<NovelCamera> path = FlyThrough(set, 101);
  const auto step = [&](size_t i) {
    return (path[i + 1].cam_from_world.TargetOriginInSource() -
            path[i].cam_from_world.TargetOriginInSource())
        .norm();
  };
  const double near = std::min(step(5), step(95)), far = std::max(step(5), step(95));
  EXPECT_NEAR(far / near, 4, 0.2);
}

TEST(FlyThrough, OddCases) {
  EXPECT_THROW(FlyThrough(Arc(3), 0), UsageError);
  EXPECT_THROW(FlyThrough(Arc(0), 5), Error);
  EXPECT_THROW(FlyThrough(DtrSet{}, 5), Error);
  EXPECT_EQ(FlyThrough(Arc(1), 5).size(), 5u);
  EXPECT_EQ(FlyThrough(Arc(2), 1).size(), 1u);
  DtrSet together = Arc(4);  // all at one place, looking differently
  for (View& view : together.frames[0].views) view.cam_from_world.translation.setZero();
  for (const NovelCamera& camera : FlyThrough(together, 7)) {
    EXPECT_TRUE(camera.cam_from_world.rotation.coeffs().allFinite());
    EXPECT_EQ(camera.cam_from_world.TargetOriginInSource().norm(), 0);
  }
}

}  // namespace
}  // namespace dtr
