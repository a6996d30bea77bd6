#include "dtr/types/camera.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "dtr/base/random.h"

namespace dtr {
namespace {

constexpr double kRoundTripPx = 1e-9;  // double; far above the worst of 1e4 draws, 2e-12
const PinholeCamera kCamera(640, 480, 500, 510, 320, 240);

TEST(PinholeCamera, HandWorkedPoint) {
  const auto pixel = kCamera.PixelFromCam({1, 2, 10});
  ASSERT_TRUE(pixel);
  EXPECT_DOUBLE_EQ(pixel->x(), 370);  // 320 + 500 * 1 / 10
  EXPECT_DOUBLE_EQ(pixel->y(), 342);  // 240 + 510 * 2 / 10
}

TEST(PinholeCamera, PointBehindCameraHasNoPixel) {
  EXPECT_FALSE(kCamera.PixelFromCam({1, 2, 0}));
  EXPECT_FALSE(kCamera.PixelFromCam({1, 2, -3}));
  EXPECT_FALSE(kCamera.PixelFromCam({1, 2, std::numeric_limits<double>::quiet_NaN()}));
}

TEST(PinholeCamera, PixelAndDepthRoundTripForBothKinds) {
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const Eigen::Vector2d pixel(random.Uniform(-100, 740), random.Uniform(-100, 580));
    const double depth = std::exp(random.Uniform(-6, 6));
    for (const auto kind : {DepthKind::kPlaneZ, DepthKind::kRayDistance}) {
      const Eigen::Vector3d p_in_cam = kCamera.CamFromPixel(pixel, depth, kind);
      ASSERT_LT((*kCamera.PixelFromCam(p_in_cam) - pixel).norm(), kRoundTripPx);
      const double measured = kind == DepthKind::kPlaneZ ? p_in_cam.z() : p_in_cam.norm();
      ASSERT_NEAR(measured / depth, 1, 1e-14);  // a few roundings of double
    }
  }
}

TEST(PinholeCamera, ResizedCameraSeesTheSamePartOfTheWorld) {
  const PinholeCamera half = kCamera.Resized(320, 160);
  const Eigen::Vector3d p_in_cam(0.3, -0.4, 2);
  const Eigen::Vector2d full_px = *kCamera.PixelFromCam(p_in_cam);
  const Eigen::Vector2d half_px = *half.PixelFromCam(p_in_cam);
  EXPECT_NEAR(half_px.x(), full_px.x() / 2, kRoundTripPx);
  EXPECT_NEAR(half_px.y(), full_px.y() / 3, kRoundTripPx);
}

TEST(PinholeCamera, RejectsImpossibleParameters) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(PinholeCamera(0, 480, 500, 500, 0, 0), std::invalid_argument);
  EXPECT_THROW(PinholeCamera(640, 480, -500, 500, 0, 0), std::invalid_argument);
  EXPECT_THROW(PinholeCamera(640, 480, 500, nan, 0, 0), std::invalid_argument);
  EXPECT_THROW(PinholeCamera(640, 480, 500, 500, nan, 0), std::invalid_argument);
}

}  // namespace
}  // namespace dtr
