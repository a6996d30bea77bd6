#include "viewer/navigation.h"

#include <gtest/gtest.h>

#include <array>

#include "dtr/base/random.h"
#include "dtr/render/geometry.h"

namespace dtr::viewer {
namespace {

constexpr double kSame = 1e-9;  // double; lengths of about 10
const Eigen::Vector3d kUp(0, -1, 0);
const PinholeCamera kLens(640, 400, 500, 500, 320, 200);

Eigen::Vector3d RandomPoint(Random& random, double size) {
  return {random.Uniform(-size, size), random.Uniform(-size, size), random.Uniform(-size, size)};
}

Pose RandomPose(Random& random) {
  const Eigen::Vector3d center = RandomPoint(random, 5);
  return LookAlong(center, RandomPoint(random, 1) + Eigen::Vector3d(0, 0, 3), kUp);
}

TEST(LookAlong, PutsUpUpwardsAndLooksThere) {
  const Pose pose = LookAlong({1, 2, 3}, {1, 0, 0}, kUp);
  EXPECT_LT((pose.TargetOriginInSource() - Eigen::Vector3d(1, 2, 3)).norm(), kSame);
  EXPECT_LT((pose * Eigen::Vector3d(6, 2, 3) - Eigen::Vector3d(0, 0, 5)).norm(), kSame);
  EXPECT_LT((pose * Eigen::Vector3d(1, 1, 3) - Eigen::Vector3d(0, -1, 0)).norm(), kSame);
  EXPECT_LT((pose * Eigen::Vector3d(1, 2, 2) - Eigen::Vector3d(1, 0, 0)).norm(), kSame);
}

TEST(FillLens, LeavesNothingOfAnyWindowOutsideTheCamera) {
  const PinholeCamera camera(300, 200, 250, 260, 140, 105);
  EXPECT_EQ(FillLens(camera, 300, 200), camera);
  for (const auto& [width, height] : {std::pair(600, 600), {900, 200}, {100, 50}, {300, 200}}) {
    const PinholeCamera filling = FillLens(camera, width, height);
    double widest = 0, highest = 0;  // of the camera, pixels
    for (const double x : {0, width}) {
      for (const double y : {0, height}) {
        const auto pixel = camera.PixelFromCam(filling.RayFromPixel({x, y}));
        ASSERT_TRUE(pixel);
        widest = std::max(widest, std::abs(pixel->x() - 150));
        highest = std::max(highest, std::abs(pixel->y() - 100));
      }
    }
    EXPECT_LE(widest, 150 + kSame);
    EXPECT_LE(highest, 100 + kSame);
    EXPECT_TRUE(widest > 150 - kSame || highest > 100 - kSame) << "and no smaller than it must be";
  }
}

TEST(Orbit, KeepsThePivotsPixelItsDistanceAndTheHorizon) {
  Random random(1);
  for (int draw = 0; draw < 200; ++draw) {
    const Pose before = RandomPose(random);
    const Eigen::Vector3d pivot = WorldPoint(
        {kLens, before}, {random.Uniform(0, 640), random.Uniform(0, 400)}, random.Uniform(1, 9));
    const Pose after =
        Orbit(before, pivot, kUp, random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5));
    EXPECT_LT((after * pivot - before * pivot).norm(), kSame);
    EXPECT_NEAR(after.rotation.norm(), 1, kSame);
    // What is level stays level: the camera's x axis has no share of up.
    EXPECT_NEAR((after.rotation.conjugate() * Eigen::Vector3d::UnitX()).dot(kUp), 0, kSame);
    EXPECT_GT((after.TargetOriginInSource() - before.TargetOriginInSource()).norm(), 0);
  }
}

TEST(Orbit, NeverTiltsOverTheTop) {
  Pose pose = LookAlong({0, 0, -5}, {0, 0, 1}, kUp);
  for (const double pitch : {0.3, -0.3}) {
    for (int step = 0; step < 30; ++step) pose = Orbit(pose, {0, 0, 0}, kUp, 0, pitch);
    const Eigen::Vector3d axis = pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    const double from_pole = pitch > 0 ? AngleBetween(axis, kUp) : AngleBetween(axis, -kUp);
    EXPECT_NEAR(from_pole, kPoleRad, 1e-6);
  }
}

TEST(Look, TurnsWithoutMoving) {
  const Pose before = LookAlong({1, 2, 3}, {0, 0, 1}, kUp);
  const Pose after = Look(before, kUp, 0.2, -0.1);
  EXPECT_LT((after.TargetOriginInSource() - before.TargetOriginInSource()).norm(), kSame);
  const Eigen::Vector3d axis = after.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(AngleBetween(axis, Eigen::Vector3d::UnitZ()), std::hypot(0.2, 0.1), 1e-3);
  EXPECT_GT(axis.y(), 0);  // pitched down
}

TEST(Approach, KeepsThePointsPixel) {
  Random random(2);
  for (int draw = 0; draw < 100; ++draw) {
    const NovelCamera camera{kLens, RandomPose(random)};
    const Eigen::Vector2d pixel(random.Uniform(0, 640), random.Uniform(0, 400));
    const double z = random.Uniform(1, 9), factor = random.Uniform(0.3, 2);
    const Eigen::Vector3d point = WorldPoint(camera, pixel, z);
    const Pose after = Approach(camera.cam_from_world, point, factor);
    EXPECT_LT((*kLens.PixelFromCam(after * point) - pixel).norm(), 1e-6);
    EXPECT_NEAR((after * point).z(), factor * z, kSame * z);
  }
}

TEST(Pan, TakesThePointAlong) {
  Random random(3);
  for (int draw = 0; draw < 100; ++draw) {
    const NovelCamera camera{kLens, RandomPose(random)};
    const Eigen::Vector2d from(100, 300), to(random.Uniform(0, 640), random.Uniform(0, 400));
    const double z = random.Uniform(1, 9);
    const Eigen::Vector3d point = WorldPoint(camera, from, z);
    const Pose after = Pan(camera, from, to, z);
    EXPECT_LT((*kLens.PixelFromCam(after * point) - to).norm(), 1e-6);
    EXPECT_NEAR((after * point).z(), z, kSame * 10);
  }
}

TEST(Between, EndsWhereItShouldAndMovesEvenly) {
  Random random(4);
  const NovelCamera a{kLens, RandomPose(random)};
  const NovelCamera b{{640, 400, 700, 710, 300, 190}, RandomPose(random)};
  const auto apart = [](const NovelCamera& p, const NovelCamera& q) {
    return (p.cam_from_world.TargetOriginInSource() - q.cam_from_world.TargetOriginInSource())
        .norm();
  };
  EXPECT_LT(apart(Between(a, b, 0), a), kSame);
  EXPECT_LT(apart(Between(a, b, 1), b), kSame);
  EXPECT_EQ(Between(a, b, 1).camera, b.camera);
  EXPECT_NEAR(apart(Between(a, b, 0.25), a), 0.25 * apart(a, b), kSame);
  EXPECT_NEAR(Between(a, b, 0.5).cam_from_world.rotation.angularDistance(a.cam_from_world.rotation),
              0.5 * a.cam_from_world.rotation.angularDistance(b.cam_from_world.rotation), 1e-6);
}

TEST(ViewAll, HasEveryCornerInThePictureAndNoneToSpare) {
  const Bounds bounds{{-3, -1, 4}, {5, 2, 11}};
  Random random(5);
  for (const PinholeCamera& lens : {kLens, PinholeCamera(300, 900, 400, 500, 100, 500)}) {
    const std::vector<Pose> cameras = {RandomPose(random), RandomPose(random)};
    const Pose pose = ViewAll(bounds, cameras, kUp, lens);
    double min_margin = 1e9;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d p(corner & 1 ? 5 : -3, corner & 2 ? 2 : -1, corner & 4 ? 11 : 4);
      const auto pixel = lens.PixelFromCam(pose * p);
      ASSERT_TRUE(pixel);
      min_margin = std::min({min_margin, pixel->x(), pixel->y(), lens.width_px() - pixel->x(),
                             lens.height_px() - pixel->y()});
    }
    EXPECT_NEAR(min_margin, 0, 1e-6);
  }
}

// Images from the air: up cannot be up in them; north, which is at the top of most, can.
TEST(ViewAll, LookingStraightDownHasTheTopOfMostPicturesAtItsTop) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), north = Eigen::Vector3d::UnitY();
  const std::vector<Pose> cameras = {LookAlong({0, 0, 9}, {0, 0.02, -1}, north),
                                     LookAlong({3, 1, 9}, {0, -0.02, -1}, north)};
  const Pose pose = ViewAll({{-4, -4, 0}, {4, 4, 1}}, cameras, up, kLens);
  EXPECT_LT((AxisInWorld(pose, -Eigen::Vector3d::UnitY()) - north).norm(), 0.03);
  EXPECT_LT((AxisInWorld(pose, Eigen::Vector3d::UnitZ()) + up).norm(), 0.03);
}

TEST(NearestView, WeighsPlaceAndDirection) {
  View here, beside, turned;
  here.cam_from_world = LookAlong({0, 0, 0}, {0, 0, 1}, kUp);
  beside.cam_from_world = LookAlong({3, 0, 0}, {0, 0, 1}, kUp);
  turned.cam_from_world = LookAlong({0, 0, 0}, {1, 0, 0}, kUp);
  const std::vector<const View*> views{&beside, &turned, &here};
  EXPECT_EQ(NearestView(views, LookAlong({0.4, 0, 0}, {0, 0, 1}, kUp), 10), 2u);
  EXPECT_EQ(NearestView(views, LookAlong({2, 0, 0}, {0, 0, 1}, kUp), 10), 0u);
  EXPECT_EQ(NearestView(views, LookAlong({0, 0, 0}, {1, 0, 0.1}, kUp), 10), 1u);
  EXPECT_FALSE(NearestView({}, Pose{}, 10).has_value());
}

}  // namespace
}  // namespace dtr::viewer
