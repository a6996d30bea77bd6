#include "dtr/types/panorama.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace dtr {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRoundTrip = 1e-12;  // of unit vectors; worst of 1000 was 3e-16

TEST(Panorama, HandWorkedDirections) {
  const Panorama panorama{400, 200, 0, 0};
  const auto expect = [&](const Vector3d& direction, double x, double y) {
    const Vector2d pixel = panorama.PixelFromDirection(direction);
    EXPECT_NEAR(pixel.x(), x, 1e-9) << direction.transpose();
    EXPECT_NEAR(pixel.y(), y, 1e-9) << direction.transpose();
  };
  expect({0, 0, 1}, 200, 100);  // the middle
  expect({2, 0, 0}, 300, 100);  // a quarter to the right
  expect({-1, 0, 0}, 100, 100);
  expect({0, -1, 0}, 200, 0);   // up is the first row
  expect({0, 1, 1}, 200, 150);  // 45 degrees down
  const Panorama part{400, 200, 150, 80};
  EXPECT_EQ(part.PixelFromDirection({0, 0, 1}), Vector2d(50, 20));
}

TEST(Panorama, PixelsAndDirectionsAreInverse) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const Panorama panorama{1000, 500, 17, 5};
  for (int i = 0; i < 1000; ++i) {
    const Vector3d direction =
        Vector3d(normal(random), normal(random), normal(random)).normalized();
    const Vector3d back = panorama.DirectionFromPixel(panorama.PixelFromDirection(direction));
    EXPECT_LT((back - direction).norm(), kRoundTrip);
  }
}

TEST(Panorama, FacesLookWhereTheirNamesSay) {
  const auto forward = [](const char* name) -> Vector3d {
    return FaceCalled(name).cam_from_panorama.transpose() * Vector3d::UnitZ();
  };
  EXPECT_EQ(forward("front"), Vector3d(0, 0, 1));
  EXPECT_EQ(forward("right"), Vector3d(1, 0, 0));
  EXPECT_EQ(forward("back"), Vector3d(0, 0, -1));
  EXPECT_EQ(forward("left"), Vector3d(-1, 0, 0));
  EXPECT_EQ(forward("up"), Vector3d(0, -1, 0));
  EXPECT_EQ(forward("down"), Vector3d(0, 1, 0));
  EXPECT_TRUE(FaceCalled("sideways").name.empty());
  // Upright: the image's y axis points down in all views around.
  for (const char* name : {"front", "right", "back", "left"}) {
    EXPECT_EQ((FaceCalled(name).cam_from_panorama * Vector3d::UnitY()), Vector3d(0, 1, 0)) << name;
  }
}

TEST(Panorama, EveryDirectionIsInOneView) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const PinholeCamera camera = FaceCamera(100);
  const auto faces = PanoramaFaces();
  ASSERT_EQ(faces.size(), 6u);
  for (const PanoramaFace& face : faces) {
    EXPECT_TRUE(
        (face.cam_from_panorama * face.cam_from_panorama.transpose()).isIdentity(kRoundTrip));
    EXPECT_NEAR(face.cam_from_panorama.determinant(), 1, kRoundTrip);
  }
  for (int i = 0; i < 1000; ++i) {
    const Vector3d direction(normal(random), normal(random), normal(random));
    EXPECT_EQ(std::count_if(faces.begin(), faces.end(),
                            [&](const auto& face) {
                              const auto pixel =
                                  camera.PixelFromCam(face.cam_from_panorama * direction);
                              return pixel && camera.Contains(*pixel);
                            }),
              1);
  }
}

TEST(Panorama, AViewHasTheResolutionOfTheEquator) {
  const int size_px = FaceSizePx(4096);
  EXPECT_EQ(size_px, 1304);
  // Pixels per radian in the middle.
  EXPECT_NEAR(FaceCamera(size_px).fx_px(), 4096 / (2 * M_PI), 0.6);
  EXPECT_EQ(FaceSizePx(1), 2);
}

}  // namespace
}  // namespace dtr
