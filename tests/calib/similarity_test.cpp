#include "calib/similarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Eigen::Vector3d RandomVector(Random& random) {
  return {random.Normal(), random.Normal(), random.Normal()};
}

Eigen::Quaterniond RandomTurn(Random& random) {
  return Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
      .normalized();
}

Points Mapped(const Similarity& b_from_a, const Points& points) {
  Points mapped;
  for (const auto& p : points) mapped.push_back(b_from_a * p);
  return mapped;
}

TEST(TurnAndShift, FindsARigidMotionAndWeighsEachCoordinate) {
  const Similarity truth{1, Eigen::Quaterniond(0.98, 0.1, -0.15, 0.05).normalized(), {0.3, -2, 5}};
  std::vector<Eigen::Vector3d> a = {{1, 2, 3}, {-2, 0, 1}, {0, 4, -1}, {3, -1, 2}, {-1, -3, 0}}, b;
  for (const Eigen::Vector3d& p : a) b.push_back(truth * p);
  std::vector<Eigen::Vector3d> sigmas(a.size(), {1, 2, 3});
  b[1].y() += 50;
  sigmas[1].y() = 1e9;  // nobody knows it
  const Similarity found = TurnAndShift(a, b, sigmas);
  constexpr double kExact = 1e-6;  // what 50 / 1e9 of a coordinate that is all but ignored leaves
  EXPECT_LT(found.rotation.angularDistance(truth.rotation), kExact);
  EXPECT_LT((found.translation - truth.translation).norm(), 10 * kExact);
  EXPECT_EQ(found.scale, 1);
}

TEST(AlignPointsAtScale, TurnsAndShiftsAndKeepsTheScale) {
  const Similarity truth{2, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1, 2, 3}};
  std::vector<Eigen::Vector3d> a = {{1, 2, 3}, {-2, 0, 1}, {0, 4, -1}, {3, -1, 2}}, b;
  for (const Eigen::Vector3d& p : a) b.push_back(truth * p);
  const Similarity found = AlignPointsAtScale(a, b, 3);
  EXPECT_EQ(found.scale, 3);
  EXPECT_LT(found.rotation.angularDistance(truth.rotation), 1e-9);
  const Eigen::Vector3d middle(0.5, 1.25, 1.25);
  EXPECT_LT((found * middle - truth * middle).norm(), 1e-9);
}

TEST(Similarity, HandWorkedPointAndInverse) {
  const Similarity b_from_a{
      2,
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
      {10, 20, 30}};
  EXPECT_LT((b_from_a * Eigen::Vector3d(1, 0, 3) - Eigen::Vector3d(10, 22, 36)).norm(), 1e-14);
  EXPECT_LT((b_from_a.Inverse() * Eigen::Vector3d(10, 22, 36) - Eigen::Vector3d(1, 0, 3)).norm(),
            1e-14);
}

TEST(Similarity, AMovedCameraSeesMovedPointsInTheSameDirection) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Similarity b_from_a{std::exp(random.Normal()), RandomTurn(random), RandomVector(random)};
    const Pose cam_from_a{RandomTurn(random), RandomVector(random)};
    const Eigen::Vector3d p_in_a = RandomVector(random);
    const Eigen::Vector3d seen_in_b = b_from_a.CamFromB(cam_from_a) * (b_from_a * p_in_a);
    EXPECT_LT((seen_in_b - b_from_a.scale * (cam_from_a * p_in_a)).norm(), 1e-12);
  }
}

TEST(AlignPoints, RecoversTheSimilarityAtAnyScaleAndOffset) {
  Random random(4);
  for (const double scale : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    for (const double offset : {0.0, 1e7}) {
      Points a;
      for (int i = 0; i < 12; ++i) a.push_back(RandomVector(random));
      const Similarity truth{scale, RandomTurn(random),
                             Eigen::Vector3d(offset, -offset, offset / 2)};
      const Points b = Mapped(truth, a);
      // What double leaves of b's coordinates, in units of the extent of b.
      const double rounding = 1e-15 * (1 + offset / scale);
      if (rounding > 1e-7) continue;  // b has no digits left to align to
      const Similarity found = AlignPoints(a, b);
      EXPECT_NEAR(found.scale / scale, 1, 10 * rounding) << scale << " " << offset;
      EXPECT_LT(found.rotation.angularDistance(truth.rotation), 1e-7 + 10 * rounding);
      EXPECT_LT(AlignmentRms(found, a, b), 10 * rounding * scale) << scale << " " << offset;
    }
  }
}

TEST(AlignPoints, TakesPointsFarFromTheOriginOnBothSides) {
  Random random(5);
  const Eigen::Vector3d far(1e7, 2e7, -1e7);
  Points a;
  for (int i = 0; i < 20; ++i) a.push_back(RandomVector(random) + far);
  const Similarity truth{3, RandomTurn(random), Eigen::Vector3d(5, 5, 5)};
  const Points b = Mapped(truth, a);
  const Similarity found = AlignPoints(a, b);
  EXPECT_NEAR(found.scale, 3, 1e-6);                // 4e-9 of rounding over an extent of 1
  EXPECT_LT(AlignmentRms(found, a, b), 1e-6 * 10);  // double at 1e8: 1.5e-8, a few times
}

TEST(AlignPoints, NoiseGivesItsOwnSizeAsResidual) {
  Random random(6);
  constexpr double kNoise = 0.01;
  constexpr int kPoints = 2000;
  Points a;
  for (int i = 0; i < kPoints; ++i) a.push_back(RandomVector(random));
  const Similarity truth{2, RandomTurn(random), {1, 2, 3}};
  Points b = Mapped(truth, a);
  for (auto& p : b) p += kNoise * RandomVector(random);
  const Similarity found = AlignPoints(a, b);
  // Three coordinates of kNoise; 6000 numbers estimate it to 1 %.
  EXPECT_NEAR(AlignmentRms(found, a, b), kNoise * std::sqrt(3.0), 0.04 * kNoise * std::sqrt(3.0));
  EXPECT_NEAR(found.scale, 2, 5 * kNoise / std::sqrt(kPoints));
  // No other similarity is better: a least-squares minimum.
  const double best = AlignmentRms(found, a, b);
  for (int i = 0; i < 50; ++i) {
    Similarity other = found;
    other.scale *= 1 + 1e-3 * random.Normal();
    other.translation += 1e-3 * RandomVector(random);
    other.rotation =
        Eigen::Quaterniond(1, 1e-3 * random.Normal(), 1e-3 * random.Normal(), 0).normalized() *
        other.rotation;
    EXPECT_GE(AlignmentRms(other, a, b), best);
  }
}

TEST(AlignPoints, FlatSetsAreEnoughAndNeverMirrored) {
  Random random(7);
  Points a;
  for (int i = 0; i < 8; ++i) a.push_back({random.Normal(), random.Normal(), 0});
  const Similarity truth{0.5, RandomTurn(random), {1, 2, 3}};
  const Similarity found = AlignPoints(a, Mapped(truth, a));
  EXPECT_LT(found.rotation.angularDistance(truth.rotation), 1e-7);
  // A mirrored set is matched by the best turn, not by a reflection.
  Points solid, mirrored;
  for (int i = 0; i < 8; ++i) {
    solid.push_back(RandomVector(random));
    mirrored.emplace_back(-solid.back().x(), solid.back().y(), solid.back().z());
  }
  EXPECT_NEAR(AlignPoints(solid, mirrored).rotation.toRotationMatrix().determinant(), 1, 1e-12);
}

TEST(AlignPoints, RejectsWhatCannotBeAligned) {
  const Points line{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}, {3, 6, 9}};
  const Points corner{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Points point(4, Eigen::Vector3d(1, 1, 1));
  EXPECT_THROW(AlignPoints(line, corner), Error);
  EXPECT_THROW(AlignPoints(corner, line), Error);
  EXPECT_THROW(AlignPoints(point, corner), Error);
  EXPECT_THROW(AlignPoints(Points(corner.begin(), corner.end() - 1), corner), Error);
  EXPECT_THROW(AlignPoints(Points(corner.begin(), corner.begin() + 2),
                           Points(corner.begin(), corner.begin() + 2)),
               Error);
  Points broken = corner;
  broken[2].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(AlignPoints(broken, corner), Error);
  Points far_line = line;
  for (auto& p : far_line) p = p * 0.1 + Eigen::Vector3d(1e7, 1e7, 1e7);
  EXPECT_THROW(AlignPoints(far_line, corner), Error);
  Points huge = corner;  // finite, but their products are not
  for (auto& p : huge) p *= 1e200;
  EXPECT_THROW(AlignPoints(huge, huge), Error);
}

}  // namespace
}  // namespace dtr::calib
