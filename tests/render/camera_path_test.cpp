#include "dtr/render/camera_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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
