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

/// Cameras that look straight along z from a grid across it, every other row turned half round.
DtrSet FlightOver(double spacing, double height) {
  DtrSet set;
  set.frames.resize(1);
  set.scene_center = {0, 0, height};
  set.bounds = {{-5, -4, height - 1}, {5, 4, height + 1}};
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column) {
      View view;
      view.id = std::to_string(10 * row + column);
      view.camera = {60, 40, 50, 50, 30, 20};
      const Eigen::Vector3d center(spacing * (column - 2), spacing * (row - 1.5), 0.1 * (row % 2));
      const double turn = row % 2 == 0 ? 0 : 3.141592653589793;
      view.cam_from_world.rotation =
          Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
      view.cam_from_world.translation = -(view.cam_from_world.rotation * center);
      set.frames[0].views.push_back(view);
    }
  }
  return set;
}

TEST(GroundOf, PicturesFromTheAirAreMappedOntoThePlaneThatTheyWereTakenIn) {
  const Ground ground = GroundOf(FlightOver(5, 10));
  EXPECT_LT((ground.Place({1, 2, -7}) - ground.Place({1, 2, 30})).norm(), 0.5);
  EXPECT_NEAR((ground.Place({3, 0, 10}) - ground.Place({0, 4, 10})).norm(), 5, 0.01);
  EXPECT_LT(ground.Place({0, -1, 10}).y(), ground.Place({0, 1, 10}).y()) << "the first photo's top";
}

TEST(GroundOf, ARigBeforeAWallIsNoFlight) {
  DtrSet set = FlightOver(0.5, 10);
  for (View& view : set.frames[0].views) {  // all upright
    const Eigen::Vector3d center = view.CenterInWorld();
    view.cam_from_world = {Eigen::Quaterniond::Identity(), -center};
  }
  const Ground ground = GroundOf(set);
  EXPECT_NEAR((ground.Place({1, -7, 3}) - ground.Place({1, 9, 3})).norm(), 0, 1e-9);
  EXPECT_LT(ground.Place({0, 0, 10}).y(), ground.Place({0, 0, 0}).y());
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
