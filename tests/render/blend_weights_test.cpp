#include "dtr/render/blend_weights.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "dtr/base/random.h"

namespace dtr {
namespace {

constexpr double kRound = 1e-14;  // a logarithm and an exponential

double Weight(const BlendParameters& p, double angle, double next = 0) {
  return std::exp(LogWeight(p, angle, next));
}

std::vector<double> Shares(const BlendParameters& p, const std::vector<double>& angles) {
  std::vector<double> shares(angles.size());
  BlendShares(p, angles, shares);
  return shares;
}

TEST(LogWeight, HandWorkedNumbers) {
  BlendParameters p;
  p.max_angle_rad = 1;
  p.pixel_angle_rad = 0.25;
  p.blend = BlendWeight::kCosine;
  p.exponent = 8;
  EXPECT_NEAR(Weight(p, std::numbers::pi / 3), 0.00390625, kRound);  // (1/2)^8
  EXPECT_EQ(Weight(p, 0), 1);
  EXPECT_EQ(Weight(p, std::numbers::pi / 2), 0);
  EXPECT_EQ(Weight(p, 3), 0);  // not cos^8, which is positive again
  p.blend = BlendWeight::kExponential;
  p.falloff = 2;
  EXPECT_NEAR(Weight(p, 0.5), 0.36787944117144233, kRound);  // falls, e^-1
  p.blend = BlendWeight::kAngle;
  EXPECT_NEAR(Weight(p, 0.25), 0.75, kRound);
  EXPECT_EQ(Weight(p, 1), 0);
  EXPECT_EQ(Weight(p, 2), 0);
  p.blend = BlendWeight::kInverseAngle;
  p.blend_k = 2;
  EXPECT_NEAR(Weight(p, 0.25), 4, 4 * kRound);
  EXPECT_NEAR(Weight(p, 0), 16, 16 * kRound);  // finite at a view's own centre
  p.blend = BlendWeight::kKNearest;
  EXPECT_NEAR(Weight(p, 0.1, 0.4), 0.75, kRound);
  EXPECT_EQ(Weight(p, 0.4, 0.4), 0);
}

TEST(NextAngle, IsTheOneAfterTheKthSmallest) {
  BlendParameters p;
  p.blend_k = 2;
  p.max_angle_rad = 1;
  EXPECT_EQ(NextAngle(p, std::vector<double>{0.5, 0.1, 0.4, 0.3}), 0.4);
  EXPECT_EQ(NextAngle(p, std::vector<double>{0.5, 0.1}), 1);
}

TEST(BlendShares, EachViewIsWeighedByItsOwnAngle) {
  // The report prints both weights with the first angle, which would give equal shares.
  BlendParameters p;
  p.exponent = 2;
  const std::vector<double> shares = Shares(p, {0, std::numbers::pi / 4});
  EXPECT_NEAR(shares[0], 2.0 / 3, kRound);
  EXPECT_NEAR(shares[1], 1.0 / 3, kRound);
}

TEST(BlendShares, ArePositiveSumToOneAndNearerCountsMore) {
  constexpr int kDraws = 2000;
  Random random(7);
  for (int draw = 0; draw < kDraws; ++draw) {
    BlendParameters p;
    p.blend = static_cast<BlendWeight>(random.Index(5));
    p.exponent = std::pow(10.0, random.Uniform(-2, 3));
    p.falloff = std::pow(10.0, random.Uniform(-2, 6));
    p.blend_k = 1 + random.Index(64);
    p.max_angle_rad = random.Uniform(1e-3, std::numbers::pi);
    p.pixel_angle_rad = random.Uniform(1e-9, 0.1);
    std::vector<double> angles;
    for (int i = 0; i <= random.Index(12); ++i) {
      angles.push_back(random.Index(5) == 0 ? 0 : random.Uniform(0, std::numbers::pi));
    }
    const std::vector<double> shares = Shares(p, angles);
    double sum = 0;
    for (size_t i = 0; i < shares.size(); ++i) {
      ASSERT_TRUE(std::isfinite(shares[i]) && shares[i] >= 0) << draw;
      sum += shares[i];
      for (size_t j = 0; j < i; ++j) {
        if (angles[i] < angles[j]) {
          ASSERT_GE(shares[i], shares[j]);
        }
        if (angles[i] == angles[j]) {
          ASSERT_EQ(shares[i], shares[j]);
        }
      }
    }
    ASSERT_NEAR(sum, 1, 1e-12) << draw;
  }
}

TEST(BlendShares, AtExtremesTheBestViewWins) {
  BlendParameters p;
  p.exponent = 1000;  // cos(1.5)^1000 = 1e-1151
  EXPECT_EQ(Shares(p, {1.5, 1.56}), (std::vector<double>{1, 0}));
  p.blend = BlendWeight::kExponential;
  p.falloff = 1e6;
  EXPECT_EQ(Shares(p, {3, 1, 2}), (std::vector<double>{0, 1, 0}));
  p.blend = BlendWeight::kAngle;
  p.max_angle_rad = 0.5;
  EXPECT_EQ(Shares(p, {3, 1, 2}), (std::vector<double>{0, 1, 0}));      // all weights are 0
  EXPECT_EQ(Shares(p, {3, 1, 1}), (std::vector<double>{0, 0.5, 0.5}));  // equal ones share
  p.blend = BlendWeight::kKNearest;
  p.blend_k = 1;
  EXPECT_EQ(Shares(p, {0, 0, 0.3}), (std::vector<double>{0.5, 0.5, 0}));
  p.blend = BlendWeight::kCosine;
  EXPECT_EQ(Shares(p, {3.0}), std::vector<double>{1});  // seen from behind, alone
  EXPECT_TRUE(Shares(p, {}).empty());
}

TEST(BlendShares, CountsTheViewsWithAWeight) {
  BlendParameters p;
  p.blend = BlendWeight::kAngle;
  p.max_angle_rad = 0.5;
  std::vector<double> shares(3);
  EXPECT_EQ(BlendShares(p, std::vector<double>{0.1, 0.6, 0.2}, shares), 2);
  EXPECT_EQ(BlendShares(p, std::vector<double>{0.9, 0.6, 0.7}, shares), 1);
}

std::vector<double> Faded(std::vector<double> shares, const std::vector<double>& factors) {
  FadeShares(factors, shares);
  return shares;
}

TEST(FadeShares, HandWorkedNumbers) {
  constexpr double kNear = 1e-5;  // what stands for others where there are none is 1e-6
  // 0.8 falls to 0.2 of itself against 0.2 that stays: 0.8 * 0.2 * 0.2 / (0.2 + 0.8 * 0.8) =
  // 0.0381.
  const std::vector<double> faded = Faded({0.8, 0.2}, {0.2, 1});
  EXPECT_NEAR(faded[0], 0.16, kNear);
  EXPECT_NEAR(faded[1], 0.84, kNear);
  EXPECT_EQ(Faded({0.8, 0.2}, {1, 1}), (std::vector<double>{0.8, 0.2}));
  EXPECT_EQ(Faded({1}, {1.0 / 255}), std::vector<double>{1});  // alone it shows what it sees
  EXPECT_EQ(Faded({0.5, 0.5}, {0.3, 0.3}), (std::vector<double>{0.5, 0.5}));
}

TEST(FadeShares, AShareFallsLinearlyHoweverMuchItWeighs) {
  Random random(5);
  for (int draw = 0; draw < 1000; ++draw) {
    const double share = 1 - std::pow(10.0, random.Uniform(-4, -0.1));
    const double part = random.Uniform(0, 1), factor = random.Uniform(1.0 / 255, 1);
    const std::vector<double> faded =
        Faded({share, part * (1 - share), (1 - part) * (1 - share)}, {factor, 1, 1});
    ASSERT_NEAR(faded[0], factor * share, 0.01) << share;  // 1e-6 against others of 1e-4
    ASSERT_NEAR(faded[0] + faded[1] + faded[2], 1, 1e-12);
    ASSERT_NEAR(faded[1] * (1 - part), faded[2] * part, 1e-12);
  }
}

}  // namespace
}  // namespace dtr
