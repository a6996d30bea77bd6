#include "dtr/types/pose.h"

#include <gtest/gtest.h>

#include "dtr/base/random.h"

namespace dtr {
namespace {

constexpr double kChained = 1e-13;  // double, coordinates of order 1; worst of 1000 draws 5e-15

Pose RandomPose(Random& random) {
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
          .normalized();
  return {rotation, {random.Normal(), random.Normal(), random.Normal()}};
}

TEST(Pose, HandWorkedQuarterTurn) {
  const Pose cam_from_world{
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
      {0, 0, 5}};
  EXPECT_LT((cam_from_world * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0, 1, 5)).norm(),
            kChained);
  EXPECT_LT((cam_from_world.TargetOriginInSource() - Eigen::Vector3d(0, 0, -5)).norm(), kChained);
}

TEST(Pose, ChainsAndInvertsLikeItsNamesSay) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const Pose b_from_a = RandomPose(random), c_from_b = RandomPose(random);
    const Eigen::Vector3d p_in_a(random.Normal(), random.Normal(), random.Normal());
    ASSERT_LT(((c_from_b * b_from_a) * p_in_a - c_from_b * (b_from_a * p_in_a)).norm(), kChained);
    ASSERT_LT((b_from_a.Inverse() * (b_from_a * p_in_a) - p_in_a).norm(), kChained);
    ASSERT_LT((b_from_a * b_from_a.TargetOriginInSource()).norm(), kChained);
  }
}

}  // namespace
}  // namespace dtr
