#include "datasets/layout.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dtr/base/error.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;

TEST(Layout, LookAtPutsTheTargetInTheMiddleAndTheSkyUp) {
  const Vector3d eye(3, -4, 2), target(0, 1, 1);
  const Pose pose = LookAt(eye, target);
  EXPECT_LT((pose.TargetOriginInSource() - eye).norm(), 1e-12);
  const Vector3d seen = pose * target;
  EXPECT_NEAR(seen.x(), 0, 1e-12);
  EXPECT_NEAR(seen.y(), 0, 1e-12);
  EXPECT_NEAR(seen.z(), (target - eye).norm(), 1e-12);
  EXPECT_LT((pose * Vector3d(0, 1, 2)).y(), 0);  // y points down
}

TEST(Layout, FocalLengthOf28MillimetresCovers36) {
  const PinholeCamera camera = MakeCamera(960, 640);
  EXPECT_DOUBLE_EQ(camera.fx_px(), 960 * 28.0 / 36);
  EXPECT_DOUBLE_EQ(camera.fy_px(), camera.fx_px());
  EXPECT_DOUBLE_EQ(camera.cx_px(), 480);
  EXPECT_DOUBLE_EQ(camera.cy_px(), 320);
}

TEST(Layout, EveryCameraOfEverySceneStandsFreeAndSeesSurfacesOnly) {
  constexpr double kClearance = 0.3;  // nearer than that nothing is in focus or matchable
  const PinholeCamera camera = MakeCamera(48, 32);
  for (const std::string& name : SceneNames()) {
    const Scene scene = MakeScene(name, 1);
    ASSERT_FALSE(scene.framing().layouts.empty());
    for (const std::string& layout : scene.framing().layouts) {
      for (const int views : {2, 7, 16, 24}) {
        const std::vector<Pose> poses = MakeLayout(scene, layout, views);
        ASSERT_EQ(poses.size(), static_cast<size_t>(views));
        for (const Pose& pose : poses) {
          const Vector3d eye = pose.TargetOriginInSource();
          for (int y = 0; y < 32; ++y) {
            for (int x = 0; x < 48; ++x) {
              const auto hit = scene.Intersect(
                  {eye, pose.rotation.conjugate() * camera.RayFromPixel({x + 0.5, y + 0.5})});
              ASSERT_TRUE(hit) << name << " " << layout << " pixel " << x << " " << y;
              ASSERT_GT(hit->t, kClearance) << name << " " << layout << " of " << views;
            }
          }
        }
      }
    }
  }
}

TEST(Layout, NeighboursAreFarEnoughApartForDepthAndNearEnoughToMatch) {
  for (const auto& [name, layout] : {std::pair{"courtyard", "arc"},
                                     {"courtyard", "grid"},
                                     {"courtyard", "line"},
                                     {"sphere", "arc"},
                                     {"stairs", "arc"},
                                     {"plane", "arc"}}) {
    const Scene scene = MakeScene(name, 1);
    const std::vector<Pose> poses = MakeLayout(scene, layout, 16);
    for (size_t i = 0; i + 1 < poses.size(); ++i) {
      if (std::string(layout) == "grid" && i % 4 == 3) continue;  // the next row begins
      const double baseline =
          (poses[i + 1].TargetOriginInSource() - poses[i].TargetOriginInSource()).norm();
      EXPECT_GT(baseline, 0.04 * scene.framing().distance) << name << " " << layout << " " << i;
      EXPECT_LT(baseline, 0.15 * scene.framing().distance) << name << " " << layout << " " << i;
    }
  }
}

TEST(Layout, WhatASceneHasNoRoomForIsRejected) {
  const Scene plane = MakeScene("plane", 1);
  try {
    MakeLayout(plane, "ring", 8);
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("arc, grid, line"), std::string::npos);
  }
  EXPECT_THROW(MakeLayout(plane, "arc", 1), UsageError);
  EXPECT_THROW(MakeLayout(plane, "spiral", 8), UsageError);
}

}  // namespace
}  // namespace dtr::datasets
