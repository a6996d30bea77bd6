#include "calib/lens_groups.h"

#include <gtest/gtest.h>

namespace dtr::calib {
namespace {

const LensCamera kPhone{CameraModel::kRadial, 1000, 750, {800, 500, 375, 0.05, -0.02}};

LensCamera Shifted(double dx, double dy) {
  LensCamera camera = kPhone;
  camera.params[1] += dx;
  camera.params[2] += dy;
  return camera;
}

TEST(LensGroups, CamerasThatDifferByThePrincipalPointAloneAreOneLens) {
  LensCamera zoomed = kPhone;
  zoomed.params[0] = 900;
  LensCamera rotated = kPhone;
  std::swap(rotated.width_px, rotated.height_px);
  const auto groups = LensGroups(
      {{3, Shifted(-9, 3)}, {4, zoomed}, {5, Shifted(6, 0)}, {8, rotated}, {9, Shifted(0, -6)}});
  ASSERT_EQ(groups.size(), 3u);
  EXPECT_EQ(groups[0].cameras, (std::vector<std::uint32_t>{3, 5, 9}));
  EXPECT_EQ(groups[0].lens.params, (std::vector<double>{800, 499, 374, 0.05, -0.02}));
  EXPECT_EQ(groups[1].cameras, std::vector<std::uint32_t>{4});
  EXPECT_EQ(groups[1].lens.params, zoomed.params);
  EXPECT_EQ(groups[2].cameras, std::vector<std::uint32_t>{8});
}

TEST(LensGroups, EqualCamerasStayApart) {
  const auto groups = LensGroups({{1, kPhone}, {2, kPhone}});
  EXPECT_EQ(groups.size(), 2u);
}

TEST(LensGroups, AStrayCameraLeavesTheOthersTogether) {
  const auto groups = LensGroups(
      {{1, Shifted(400, 0)}, {2, Shifted(1, 0)}, {3, Shifted(0, 2)}, {4, Shifted(-4, 4)}});
  ASSERT_EQ(groups.size(), 2u);
  EXPECT_EQ(groups[0].cameras, std::vector<std::uint32_t>{1});
  EXPECT_EQ(groups[1].cameras, (std::vector<std::uint32_t>{2, 3, 4}));
  EXPECT_EQ(groups[1].lens.params, (std::vector<double>{800, 499, 377, 0.05, -0.02}));
}

TEST(LensGroups, CroppedPicturesAreNoStabilisersWork) {
  // 5 % of 1000 px: means lie between the two, half of their distance from each.
  EXPECT_EQ(LensGroups({{1, kPhone}, {2, Shifted(99, 0)}}).size(), 1u);
  EXPECT_EQ(LensGroups({{1, kPhone}, {2, Shifted(102, 0)}}).size(), 2u);
}

}  // namespace
}  // namespace dtr::calib
