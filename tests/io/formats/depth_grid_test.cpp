#include "dtr/io/formats/depth_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace dtr::io {
namespace {

TEST(DepthGrid, ScalesDivideThePhotoAndLoseNoPixelOfTheMap) {
  EXPECT_EQ(DepthScaleFor(480, 360, 480, 360), 1);
  EXPECT_EQ(DepthScaleFor(240, 180, 480, 360), 2);
  EXPECT_EQ(DepthScaleFor(64, 48, 480, 360), 6);      // 7.5; 7 does not divide
  EXPECT_EQ(DepthScaleFor(128, 96, 480, 360), 3);     // 3.75
  EXPECT_EQ(DepthScaleFor(256, 192, 1920, 1440), 6);  // LiDAR of phones
  EXPECT_EQ(DepthScaleFor(192, 256, 1440, 1920), 6);
  EXPECT_EQ(DepthScaleFor(64, 43, 1279, 853), 1);  // primes: full size
  EXPECT_EQ(DepthScaleFor(640, 480, 480, 360), 1);
}

TEST(DepthGrid, AnotherShapeShowsSomethingElse) {
  EXPECT_EQ(DepthScaleFor(64, 36, 480, 360), std::nullopt);
  EXPECT_EQ(DepthScaleFor(48, 64, 480, 360), std::nullopt);
  EXPECT_EQ(DepthScaleFor(480, 359, 480, 360), std::nullopt);
}

SourceOfPixel ScaledBy(double factor) {
  return [factor](const Eigen::Vector2d& pixel) { return Eigen::Vector2d(factor * pixel); };
}

TEST(Resampled, APlaneStaysThePlane) {
  const auto z_at = [](double x, double y) { return 1 / (0.5 - 0.004 * x + 0.002 * y); };
  DepthImage map(16, 12);
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 16; ++x)
      map(x, y) = static_cast<float>(z_at(7.5 * (x + 0.5), 7.5 * (y + 0.5)));
  }
  const DepthImage out = Resampled(map, 20, 15, ScaledBy(6 / 7.5));
  constexpr double kFloat = 1e-5;
  for (int y = 0; y < 15; ++y) {
    for (int x = 0; x < 20; ++x) {
      EXPECT_NEAR(out(x, y) / z_at(6 * (x + 0.5), 6 * (y + 0.5)), 1, kFloat) << x << " " << y;
    }
  }
}

TEST(Resampled, NoDepthLiesBetweenTwoSurfaces) {
  DepthImage map(10, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 10; ++x) map(x, y) = x < 5 ? 2.0f : 3.0f;
  }
  const DepthImage out = Resampled(map, 75, 30, ScaledBy(1 / 7.5));
  EXPECT_TRUE(std::all_of(out.grid().data().begin(), out.grid().data().end(),
                          [](float z) { return z == 2.0f || z == 3.0f; }));
  EXPECT_EQ(out(36, 3), 2.0f);
  EXPECT_EQ(out(38, 3), 3.0f);
}

TEST(Resampled, ASlantedSurfaceIsContinuedToItsEdge) {
  DepthImage map(8, 1);
  for (int x = 0; x < 8; ++x) map(x, 0) = x < 4 ? 1 / (0.5f - 0.05f * static_cast<float>(x)) : 9.0f;
  const DepthImage out = Resampled(map, 16, 1, ScaledBy(0.5));
  // Pixel 7 lies at 3.75, a quarter beyond the centre of the surface's last pixel.
  EXPECT_NEAR(1 / out(7, 0), 0.5 - 0.05 * 3.25, 1e-6);
  EXPECT_EQ(out(8, 0), 9.0f);
}

TEST(Resampled, HolesStayHoles) {
  DepthImage map(4, 4);
  map(1, 1) = 5;
  const DepthImage out = Resampled(map, 8, 8, ScaledBy(0.5));
  EXPECT_EQ(std::count(out.grid().data().begin(), out.grid().data().end(), 5.0f), 4);
  EXPECT_EQ(std::count(out.grid().data().begin(), out.grid().data().end(), 0.0f), 60);
}

}  // namespace
}  // namespace dtr::io
