#include "stereo/normals.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace dtr::stereo {
namespace {

constexpr int kWidth = 40, kHeight = 30;
const PinholeCamera kCamera(kWidth, kHeight, 50, 60, 21, 14);

/// The plane n . p = 1 as a camera at the origin sees it, inverse depths in units of 1 / `unit_z`.
struct SeenPlane {
  PlaneMap planes{Grid<float>(kWidth, kHeight), Grid<float>(kWidth, kHeight),
                  Grid<float>(kWidth, kHeight)};
  DepthImage depth{kWidth, kHeight};

  SeenPlane(const Eigen::Vector3d& n, double unit_z) {
    planes.unit_z = unit_z;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d ray = kCamera.CamFromPixel({x + 0.5, y + 0.5}, 1, DepthKind::kPlaneZ);
        depth(x, y) = static_cast<float>(1 / n.dot(ray));
        planes.inverse_depth(x, y) = static_cast<float>(unit_z * n.dot(ray));
        planes.slope_x(x, y) = static_cast<float>(unit_z * n.x() / kCamera.fx_px());
        planes.slope_y(x, y) = static_cast<float>(unit_z * n.y() / kCamera.fy_px());
      }
    }
  }
};

TEST(Normals, AreThePlanesTurnedToTheCameraInAnyUnit) {
  const Eigen::Vector3d n(0.05, -0.08, 0.25);
  for (const double unit_z : {1.0, 3.5, 1e4}) {
    const SeenPlane seen(n, unit_z);
    const Grid<float> normals = NormalsOf(seen.planes, seen.depth, kCamera);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Eigen::Vector3d found(normals(x, y, 0), normals(x, y, 1), normals(x, y, 2));
        ASSERT_LT((found + n.normalized()).norm(), 1e-5) << x << ", " << y;
      }
    }
  }
}

TEST(Normals, AreLeftOutWhereTheDepthIsNotThePlanes) {
  SeenPlane seen({0, 0, 0.25}, 1);
  seen.depth(3, 4) = 0;
  seen.depth(5, 6) *= 1.03f;
  seen.depth(7, 8) *= 1.01f;
  const Grid<float> normals = NormalsOf(seen.planes, seen.depth, kCamera);
  EXPECT_EQ(normals(3, 4, 2), 0);
  EXPECT_EQ(normals(5, 6, 2), 0);
  EXPECT_EQ(normals(7, 8, 2), -1);
  const Grid<float> none = NormalsOf({}, seen.depth, kCamera);
  EXPECT_EQ(none(9, 9, 2), 0);
  EXPECT_THROW(NormalsOf(seen.planes, DepthImage(kWidth, kHeight - 1), kCamera),
               std::invalid_argument);
}

}  // namespace
}  // namespace dtr::stereo
