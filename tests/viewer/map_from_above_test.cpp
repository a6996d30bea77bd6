#include "viewer/map_from_above.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/exact/analytic_scene.h"

namespace dtr::viewer {
namespace {

using testing::Photograph;
using testing::Plane;
using testing::Shot;

/// Two cameras before a wall at z = 10; the world's y axis is down.
DtrSet BeforeAWall() {
  DtrSet set;
  set.frames.resize(1);
  set.scene_center = {0, 0, 10};
  set.bounds = {{-6, -4, 9}, {6, 4, 11}};
  for (const double x : {-2.0, 2.0}) {
    Shot shot;
    shot.id = x < 0 ? "left <1>" : "right";
    shot.cam_from_world = testing::LookAt({x, 0, 0}, {x, 0, 10});
    set.frames[0].views.push_back(Photograph(Plane({0, 0, 1}, 10), shot));
  }
  return set;
}

TEST(GroundOf, LooksDownWithWhatTheCamerasSeeAtTheTop) {
  const DtrSet set = BeforeAWall();
  const Ground ground = GroundOf(set);
  const Eigen::Vector2d wall = ground.Place({0, 0, 10}), cameras = ground.Place({0, 0, 0});
  EXPECT_LT(wall.y(), cameras.y());
  EXPECT_NEAR(wall.x(), cameras.x(), 1e-9);
  EXPECT_LT(ground.Place({-1, 5, 0}).x(), ground.Place({1, -5, 0}).x());
  EXPECT_NEAR(ground.Place({0, 7, 3}).y(), ground.Place({0, -7, 3}).y(), 1e-9);
  for (const double x : {-6.0, 6.0}) {
    const Eigen::Vector2d corner = ground.Place({x, 0, 11});
    EXPECT_TRUE((corner.array() > ground.min.array()).all());
    EXPECT_TRUE((corner.array() < ground.max.array()).all());
  }
}

TEST(CoverageFromAbove, CountsViewsWhereTheWallStandsAndNowhereElse) {
  const DtrSet set = BeforeAWall();
  const Ground ground = GroundOf(set);
  CoverageFromAbove coverage(ground, 100);
  for (const View& view : set.frames[0].views) coverage.Add(view);
  const auto count_at = [&](double x, double z) {
    const Eigen::Vector2d share =
        (ground.Place({x, 0, z}) - ground.min).cwiseQuotient(ground.max - ground.min);
    return coverage.counts()(static_cast<int>(share.x() * coverage.counts().width()),
                             static_cast<int>(share.y() * coverage.counts().height()));
  };
  EXPECT_EQ(count_at(0.3, 10), 2);  // 4.8 to either side of each camera
  EXPECT_EQ(count_at(-5, 10), 1);
  EXPECT_EQ(count_at(5, 10), 1);
  EXPECT_EQ(count_at(0, 8), 0);
  EXPECT_EQ(count_at(0, 0), 0);
}

TEST(CameraMapSvg, HasEveryCameraAndEscapesTheirNames) {
  const DtrSet set = BeforeAWall();
  const std::string svg =
      CameraMapSvg(set, GroundOf(set), [](const View&) { return std::string("red"); });
  EXPECT_THAT(svg, ::testing::StartsWith("<svg"));
  EXPECT_THAT(svg, ::testing::HasSubstr("left &lt;1&gt;"));
  EXPECT_THAT(svg, ::testing::HasSubstr("right"));
  EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("nan")));
}

}  // namespace
}  // namespace dtr::viewer
