#include "dtr/types/depth_image.h"

#include <gtest/gtest.h>

#include <limits>

#include "dtr/types/view.h"

namespace dtr {
namespace {

TEST(DepthImage, ZeroNegativeNanAndInfinityAreHoles) {
  EXPECT_TRUE(DepthImage::IsHole(0));
  EXPECT_TRUE(DepthImage::IsHole(-1));
  EXPECT_TRUE(DepthImage::IsHole(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_TRUE(DepthImage::IsHole(std::numeric_limits<float>::infinity()));
  EXPECT_FALSE(DepthImage::IsHole(1e-30f));
}

TEST(DepthImage, StartsAsAllHoles) {
  const DepthImage depth(3, 2);
  for (const float z : depth.grid().data()) EXPECT_TRUE(DepthImage::IsHole(z));
}

TEST(ToPlaneZ, RayDistanceOfASphereAroundTheCameraBecomesZ) {
  const PinholeCamera camera(4, 4, 2, 2, 2, 2);
  DepthImage ray(4, 4, DepthKind::kRayDistance);
  for (float& d : ray.grid().data()) d = 5;
  ray(0, 0) = 0;
  const DepthImage z = ToPlaneZ(ray, camera);
  EXPECT_EQ(z.kind(), DepthKind::kPlaneZ);
  EXPECT_TRUE(DepthImage::IsHole(z(0, 0)));
  // Pixel (3, 2): ray (0.75, 0.25, 1), length sqrt(1.625).
  EXPECT_FLOAT_EQ(z(3, 2), static_cast<float>(5 / std::sqrt(1.625)));
}

TEST(View, DepthPixelCentreMapsToScaledImagePixel) {
  View view;
  view.camera = PinholeCamera(640, 480, 500, 510, 321, 239);
  view.depth_scale = 2;
  const PinholeCamera depth_camera = view.DepthCamera();
  EXPECT_EQ(depth_camera.width_px(), 320);
  const Eigen::Vector3d p_in_cam = depth_camera.CamFromPixel({10.5, 20.5}, 3, DepthKind::kPlaneZ);
  const Eigen::Vector2d pixel = *view.camera.PixelFromCam(p_in_cam);
  EXPECT_NEAR(pixel.x(), 21, 1e-9);  // 2 (10 + 0.5)
  EXPECT_NEAR(pixel.y(), 41, 1e-9);
  view.depth_scale = 7;
  EXPECT_THROW(view.DepthCamera(), std::invalid_argument);
}

}  // namespace
}  // namespace dtr
