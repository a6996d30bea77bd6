// Neighbours, depth ranges, rectification: what is decided before any pixel is compared.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "datasets/exact/stereo_scene.h"
#include "dtr/base/error.h"
#include "stereo/depth_range.h"
#include "stereo/neighbours.h"
#include "stereo/sgbm/planes.h"
#include "stereo/sgbm/rectify.h"

namespace dtr::stereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Facing;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const PinholeCamera kCamera(320, 240, 300, 300, 160, 120);

StereoView ViewAt(const Pose& cam_from_world) {
  return {kCamera, cam_from_world, nullptr, nullptr};
}

/// Camera on a circle of radius 10 around the origin, looking at it.
Pose OnArc(double angle_deg) {
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(angle_deg * std::numbers::pi / 180, Vector3d::UnitY()));
  return {turn, Vector3d(0, 0, 10)};
}

/// Points in a ball of radius 2 around the origin, seen by every view.
SparseScene Ball(const std::vector<StereoView>& views, int count) {
  SparseScene scene;
  Random random(1);
  for (int i = 0; i < count; ++i) {
    scene.points.push_back({{random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)}});
  }
  for (int v = 0; v < static_cast<int>(views.size()); ++v) {
    for (int i = 0; i < count; ++i) {
      const auto& p = scene.points[static_cast<size_t>(i)].p_in_world;
      const auto& view = views[static_cast<size_t>(v)];
      scene.observations.push_back({v, i, *view.camera.PixelFromCam(view.cam_from_world * p)});
    }
  }
  return scene;
}

std::vector<StereoView> Arc(const std::vector<double>& angles_deg) {
  std::vector<StereoView> views;
  for (const double a : angles_deg) views.push_back(ViewAt(OnArc(a)));
  return views;
}

TEST(ChooseNeighbours, PrefersMiddlingAnglesOverSmallAndLarge) {
  const auto views = Arc({0, 1.5, 7, 16, 40});
  const auto chosen = ChooseNeighbours(views, Ball(views, 50), {.count = 3});
  EXPECT_EQ(chosen[0].views, (std::vector<int>{2, 3, 1}));
  EXPECT_EQ(chosen[0].evidence, NeighbourEvidence::kSharedPoints);
}

TEST(ChooseNeighbours, PrefersViewsThatShareMorePoints) {
  const auto views = Arc({0, 7, -7});
  SparseScene scene = Ball(views, 50);
  std::erase_if(scene.observations, [](const auto& o) { return o.view == 1 && o.point >= 20; });
  EXPECT_EQ(ChooseNeighbours(views, scene, {})[0].views, (std::vector<int>{2, 1}));
}

TEST(ChooseNeighbours, PrefersEqualImageScale) {
  auto views = Arc({0, 7, -7});
  views[1].cam_from_world.translation.z() = 20;  // half as large in the image
  EXPECT_EQ(ChooseNeighbours(views, Ball(views, 50), {})[0].views.front(), 2);
}

TEST(ChooseNeighbours, NeverTakesAViewFromTheSamePlace) {
  auto views = Arc({0, 0, 7});
  EXPECT_EQ(ChooseNeighbours(views, Ball(views, 50), {.min_angle_deg = 0})[0].views,
            (std::vector<int>{2}));
}

TEST(ChooseNeighbours, TakesNarrowPairsOnlyWhereThereAreNoOthers) {
  // A long lens: baselines are 1e-4 of the distance and less, the longest says most.
  const auto narrow = Arc({0, 0.004, 0.0057});
  EXPECT_EQ(ChooseNeighbours(narrow, Ball(narrow, 50), {})[0].views, (std::vector<int>{2, 1}));
  const auto mixed = Arc({0, 0.05, 7});
  EXPECT_EQ(ChooseNeighbours(mixed, Ball(mixed, 50), {})[0].views, (std::vector<int>{2}));
}

TEST(ChooseNeighbours, SaysWhenItGuessesFromTheCamerasAlone) {
  const auto views = Arc({0, 90, 7, 14, 180});
  const auto chosen = ChooseNeighbours(views, {}, {.count = 2});
  EXPECT_EQ(chosen[0].evidence, NeighbourEvidence::kGeometry);
  EXPECT_EQ(chosen[0].views, (std::vector<int>{2, 3}));
  // Parallel cameras meet nowhere; the distance between them is all there is.
  std::vector<StereoView> row;
  for (int i = 0; i < 4; ++i) row.push_back(ViewAt(Facing({0.5 * i, 0, 0})));
  EXPECT_EQ(ChooseNeighbours(row, {}, {.count = 1})[0].views, (std::vector<int>{1}));
}

TEST(ChooseNeighbours, RejectsObservationsOfMissingViewsOrPoints) {
  const auto views = Arc({0, 7});
  SparseScene scene = Ball(views, 20);
  scene.observations.push_back({2, 0, Vector2d(1, 1)});
  EXPECT_THROW(ChooseNeighbours(views, scene, {}), std::invalid_argument);
  scene.observations.back().view = 0;
  scene.observations.back().point = 20;
  EXPECT_THROW(ChooseNeighbours(views, scene, {}), std::invalid_argument);
}

TEST(DepthRanges, AreWidenedPercentilesOfTheObservedPoints) {
  const std::vector<StereoView> views{ViewAt(Facing({0, 0, 0}))};
  SparseScene scene;
  for (int i = 0; i < 101; ++i) scene.points.push_back({{0, 0, 1.0 / (0.1 + 0.001 * i)}});
  scene.points.back().p_in_world.z() = 1e-3;  // a point that went wrong
  for (int i = 0; i < 101; ++i) scene.observations.push_back({0, i, {160, 120}});
  const DepthRange range =
      DepthRangesFromPoints(views, scene, {.near_margin = 1.25, .far_margin = 2})[0];
  EXPECT_NEAR(range.near_z, 1 / (0.199 * 1.25), 1e-9);
  EXPECT_NEAR(range.far_z, 2 / 0.101, 1e-9);
}

TEST(DepthRanges, OfAViewWithoutObservationsComeFromAllVisiblePoints) {
  const auto views = Arc({0, 7});
  SparseScene scene = Ball(views, 50);
  const auto before = DepthRangesFromPoints(views, scene, {});
  std::erase_if(scene.observations, [](const auto& o) { return o.view == 1; });
  const auto after = DepthRangesFromPoints(views, scene, {});
  EXPECT_EQ(before[1].near_z, after[1].near_z);
  EXPECT_EQ(before[1].far_z, after[1].far_z);
}

TEST(DepthRanges, AViewThatSeesTooFewPointsIsNamed) {
  const auto views = Arc({0, 7});
  EXPECT_THAT(
      [&] {
        DepthRangesFromPoints(views, {}, {.names = {"a.jpg", "b.jpg"}});
      },
      ThrowsMessage<Error>(
          HasSubstr("view a.jpg: expected at least 12 sparse points in view, which "
                    "give its depth range, found 0; take more photos of what it shows")));
}

TEST(RectifyPair, PutsPointsOnOneRowWithTheDisparityOfTheirDepth) {
  Random random(3);
  const DepthRange range{3, 12};
  for (const Pose& neighbour : {Facing({0.5, 0, 0}), Facing({-0.5, 0, 0}), Facing({0, 0.4, 0}),
                                Facing({0.3, -0.3, 0}, 90), Facing({0.4, 0.1, 0.05}, -30)}) {
    const StereoView a = ViewAt(Facing({0, 0, 0}, 10)), b = ViewAt(neighbour);
    std::string rejection;
    const auto pair = RectifyPair(a, b, range, {}, &rejection);
    ASSERT_TRUE(pair) << rejection;
    const Sweep full = pair->FullSweep(0);
    for (int i = 0; i < 50; ++i) {
      const double z = random.Uniform(range.near_z, range.far_z);
      const Vector3d p_in_a = kCamera.CamFromPixel({random.Uniform(0, 320), random.Uniform(0, 240)},
                                                   z, DepthKind::kPlaneZ);
      const Vector3d p_in_b = b.cam_from_world * (a.cam_from_world.Inverse() * p_in_a);
      const Vector2d left = *pair->camera.PixelFromCam(pair->rect_from_reference * p_in_a);
      const Vector2d right = *pair->camera.PixelFromCam(pair->rect_from_neighbour * p_in_b);
      constexpr double kRoundingPx = 1e-9;
      EXPECT_NEAR(left.y(), right.y(), kRoundingPx);
      const double disparity = left.x() - right.x();
      const double rect_z = (pair->rect_from_reference * p_in_a).z();
      EXPECT_NEAR(disparity, pair->camera.fx_px() * pair->baseline / rect_z, kRoundingPx);
      EXPECT_GE(disparity, full.DisparityAt(left, 0));
      EXPECT_LE(disparity, full.DisparityAt(left, full.steps));
    }
  }
}

TEST(RectifyPair, SweepAroundAPlaneIsConstantOnIt) {
  const StereoView a = ViewAt(Facing({0, 0, 0})), b = ViewAt(Facing({0.4, 0.2, 0}, 20));
  std::string rejection;
  const auto pair = RectifyPair(a, b, {3, 12}, {}, &rejection);
  ASSERT_TRUE(pair) << rejection;
  const Vector3d n(0.05, -0.1, 0.2);  // n . p = 1
  const auto sweep = pair->SweepAround(n, 32);
  ASSERT_TRUE(sweep);
  for (const Vector2d& pixel : {Vector2d(10, 20), Vector2d(300, 30), Vector2d(150, 200)}) {
    const Vector3d ray = kCamera.RayFromPixel(pixel);
    const Vector3d p = pair->rect_from_reference * (ray / n.dot(ray));
    EXPECT_NEAR(sweep->DisparityAt(*pair->camera.PixelFromCam(p), 16),
                pair->camera.fx_px() * pair->baseline / p.z(), 1e-9);
  }
}

TEST(RectifyPair, RejectsWhatCannotBeRectifiedAndSaysWhy) {
  const StereoView a = ViewAt(Facing({0, 0, 0}));
  const DepthRange range{3, 12};
  const auto why = [&](const StereoView& b) {
    std::string rejection;
    EXPECT_FALSE(RectifyPair(a, b, range, {}, &rejection));
    return rejection;
  };
  EXPECT_EQ(why(a), "no baseline");
  EXPECT_NE(why(ViewAt(Facing({0, 0, 1}))), "");
  EXPECT_NE(why(ViewAt(Facing({0.2, 0, 1}))), "");
  const StereoView turned = ViewAt(
      Pose{Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitY())), {0, 0, 9}});
  EXPECT_NE(why(turned), "");
}

TEST(RectifyPair, StaysWithinItsLimits) {
  const StereoView a = ViewAt(Facing({0, 0, 0})), b = ViewAt(Facing({1.5, 0, 0}));
  std::string rejection;
  const PairLimits limits{.max_disparities = 128, .max_volume = 2'000'000};
  const auto pair = RectifyPair(a, b, {1, 12}, limits, &rejection);
  ASSERT_TRUE(pair) << rejection;
  const int steps = pair->FullSweep(0).steps;
  EXPECT_LE(steps, 128);
  EXPECT_LE(std::int64_t{steps} * pair->camera.width_px() * pair->camera.height_px(), 2'100'000);
}

TEST(DominantPlanes, FindsTheFloorAndTheWall) {
  DepthImage depth(160, 120);
  const PinholeCamera camera(160, 120, 150, 150, 80, 60);
  const Vector3d floor(0, 0.5, 0), wall(0.02, 0, 0.1);
  Random random(5);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
      double inverse = std::max(floor.dot(ray), wall.dot(ray));
      if (random.Uniform() < 0.2) inverse = random.Uniform(0.05, 0.3);
      depth(x, y) = static_cast<float>(1 / inverse);
    }
  }
  const auto planes = DominantPlanes(depth, camera, Vector3d(0, 0, 0.002), {});
  ASSERT_GE(planes.size(), 2u);
  const bool wall_first = (planes[0] - wall).norm() < (planes[0] - floor).norm();
  EXPECT_LT((planes[wall_first ? 0 : 1] - wall).norm(), 0.002);
  EXPECT_LT((planes[wall_first ? 1 : 0] - floor).norm(), 0.002);
}

}  // namespace
}  // namespace dtr::stereo
