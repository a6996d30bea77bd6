#include "viewer/flight.h"

#include <gtest/gtest.h>

#include "viewer/navigation.h"

namespace dtr::viewer {
namespace {

constexpr double kSame = 1e-12;  // of coordinates of about 1

NovelCamera At(double x, double yaw_rad = 0) {
  const Eigen::Quaterniond cam_from_world(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY()));
  return {PinholeCamera(40, 30, 50, 50, 20, 15),
          {cam_from_world, -(cam_from_world * Eigen::Vector3d(x, 0, 0))}};
}

double X(const NovelCamera& camera) { return camera.cam_from_world.TargetOriginInSource().x(); }

const PinholeCamera kWindow(80, 80, 1, 1, 0, 0);

TEST(Flight, HasItsKeysAmongItsFramesAndEvenStepsBetween) {
  Flight flight;
  for (const double x : {0.0, 1.0, 2.0}) flight.AddKey(At(x));
  flight.frames_per_key = 10;
  const auto frames = flight.Frames(kWindow);
  ASSERT_EQ(frames.size(), 21U);
  for (size_t i = 0; i < frames.size(); ++i) EXPECT_NEAR(X(frames[i]), 0.1 * i, 1e-3) << i;
  EXPECT_NEAR(X(frames.back()), 2, kSame);
  EXPECT_EQ(frames[3].camera.width_px(), 80);
  EXPECT_EQ(frames[3].camera.height_px(), 80);
}

TEST(Flight, TakesCamerasOfAFileAsTheyAre) {
  Flight flight;
  flight.AddKey(At(7));
  flight.Replace({At(0), At(5), At(6, 1)});
  const auto frames = flight.Frames(kWindow);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[1].cam_from_world.translation, At(5).cam_from_world.translation);
  EXPECT_EQ(frames[2].cam_from_world.rotation.coeffs(), At(6, 1).cam_from_world.rotation.coeffs());
}

TEST(Flight, TakesAsLongAsTheVideoAndEndsAtItsEnd) {
  Flight flight;
  flight.AddKey(At(0));
  flight.AddKey(At(1));
  flight.frames_per_key = 24;
  flight.StartOrStop(kWindow);
  ASSERT_TRUE(flight.flying());
  EXPECT_NEAR(X(*flight.Advance(0.5, 24)), 0, kSame);
  EXPECT_NEAR(X(*flight.Advance(10, 24)), 0.5, 1e-3);
  EXPECT_NEAR(X(*flight.Advance(10, 24)), 1, kSame);  // a slow frame skips others, not the last
  EXPECT_FALSE(flight.flying());
  EXPECT_FALSE(flight.Advance(0.1, 24));
}

TEST(Flight, WithoutAKeyDoesNothing) {
  Flight flight;
  EXPECT_TRUE(flight.Frames(kWindow).empty());
  flight.StartOrStop(kWindow);
  EXPECT_FALSE(flight.flying());
  flight.AddKey(At(3));
  EXPECT_EQ(flight.Frames(kWindow).size(), 1U);
}

TEST(Flight, StaysWhereItIsWhenTheOriginMoves) {
  const Eigen::Vector3d shift(10, -20, 30), p(1, 2, 9);
  Flight flight;
  flight.AddKey(At(1, 0.3));
  const Eigen::Vector3d before = flight.keys()[0].cam_from_world * p;
  flight.MoveWorld(shift);
  EXPECT_LT((flight.keys()[0].cam_from_world * (p - shift) - before).norm(), 1e-12);
}

}  // namespace
}  // namespace dtr::viewer
