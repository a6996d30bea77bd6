#include "calib/scale.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

MeasuredDistance Between(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double length_m,
                         double sigma = 1e-3) {
  const Eigen::Matrix3d covariance = sigma * sigma * Eigen::Matrix3d::Identity();
  constexpr double kExact = 1e-12;  // metres
  return {"`distance`", a, b, covariance, covariance, length_m, kExact};
}

Eigen::Vector3d Draw(Random& random) {
  const double x = random.Normal(), y = random.Normal();
  return {x, y, random.Normal()};
}

TEST(ScaleFromDistances, OneDistanceSaysIt) {
  const MeasuredDistance one = Between({0, 0, 0}, {3, 4, 0}, 2.5);
  const DistanceScale scale = ScaleFromDistances(std::span(&one, 1));
  EXPECT_DOUBLE_EQ(scale.metres_per_unit, 0.5);
  // Two ends that err by 1e-3 each along 5 units.
  EXPECT_NEAR(scale.relative_sigma, std::sqrt(2.0) * 1e-3 / 5, 1e-12);
}

TEST(ScaleFromDistances, PredictedUncertaintyIsWhatNoiseDoes) {
  Random random(3);
  constexpr int kSolves = 2000;
  double squares = 0;
  for (int k = 0; k < kSolves; ++k) {
    std::vector<MeasuredDistance> distances;
    for (const double length : {1.0, 2.0, 4.0}) {
      distances.push_back(Between(
          0.01 * Draw(random), Eigen::Vector3d(length, 0, 0) + 0.01 * Draw(random), length, 0.01));
    }
    const DistanceScale scale = ScaleFromDistances(distances);
    // Unwidened: what the weights alone say.
    const double predicted = 1 / std::sqrt((1 + 4 + 16) / (2 * 1e-4));
    squares += std::pow((scale.metres_per_unit - 1) / predicted, 2);
  }
  // The mean of 2000 squares of normal numbers is within 1 +- 0.095 in three of its sigmas.
  EXPECT_NEAR(squares / kSolves, 1, 0.1);
}

TEST(ScaleFromDistances, WhatDoesNotFitIsRejectedByName) {
  const MeasuredDistance together = Between({1, 1, 1}, {1, 1, 1}, 2);
  EXPECT_THROW(ScaleFromDistances(std::span(&together, 1)), Error);
  const MeasuredDistance near = Between({0, 0, 0}, {0.005, 0, 0}, 2);
  EXPECT_THROW(ScaleFromDistances(std::span(&near, 1)), Error);
  const std::vector<MeasuredDistance> apart = {Between({0, 0, 0}, {1, 0, 0}, 2),
                                               Between({0, 0, 0}, {1, 0, 0}, 2.1)};
  EXPECT_THROW(ScaleFromDistances(apart), Error);
  EXPECT_THROW(ScaleFromDistances({}), Error);
}

TEST(ScaleFromDistances, ALengthWithoutAnErrorIsNotTakenForExact) {
  // Camera centres have no covariance here; their distances differ as those of real rigs do.
  const auto centres = [](double length, double length_m) {
    MeasuredDistance d = Between({0, 0, 0}, {length, 0, 0}, length_m, 0);
    d.sigma_m = 0;
    return d;
  };
  const std::vector<MeasuredDistance> two = {centres(1, 0.12), centres(1.001, 0.12)};
  const DistanceScale scale = ScaleFromDistances(two);
  EXPECT_NEAR(scale.metres_per_unit, 0.12, 1e-3);
  EXPECT_GT(scale.relative_sigma, 5e-4);
  // One that says far more than the other leaves it no weight, and no NaN either.
  std::vector<MeasuredDistance> unequal = {centres(1, 0.12),
                                           Between({0, 0, 0}, {1, 0, 0}, 0.1199, 0.01)};
  unequal[0].sigma_m = 1e-15;
  for (const double sigmas : ScaleFromDistances(unequal).sigmas) EXPECT_TRUE(std::isfinite(sigmas));
}

TEST(ScaleFromDistances, DisagreementWidensTheUncertainty) {
  const std::vector<MeasuredDistance> agree = {Between({0, 0, 0}, {1, 0, 0}, 2),
                                               Between({0, 0, 0}, {0, 1, 0}, 2)};
  const std::vector<MeasuredDistance> differ = {Between({0, 0, 0}, {1, 0, 0}, 2),
                                                Between({0, 0, 0}, {0, 1, 0}, 2.01)};
  EXPECT_GT(ScaleFromDistances(differ).relative_sigma,
            2 * ScaleFromDistances(agree).relative_sigma);
}

TEST(Earth, AKnownPlace) {
  // The equator's and the pole's radii of WGS 84, by hand.
  EXPECT_LT((EarthFromGeodetic(0, 0, 0) - Eigen::Vector3d(6378137, 0, 0)).norm(), 1e-6);
  EXPECT_LT((EarthFromGeodetic(90, 0, 10) - Eigen::Vector3d(0, 0, 6356752.314245 + 10)).norm(),
            1e-5);
  const Eigen::Vector3d here = EarthFromGeodetic(55.698, 13.195, 37);
  const Eigen::Vector3d north = EarthFromGeodetic(55.6981, 13.195, 37);
  const Eigen::Vector3d up = EarthFromGeodetic(55.698, 13.195, 38);
  const Eigen::Matrix3d axes = EnuFromEarth(55.698, 13.195);
  EXPECT_LT((axes * (up - here) - Eigen::Vector3d(0, 0, 1)).norm(), 1e-6);
  const Eigen::Vector3d step = axes * (north - here);
  // The meridian's radius there, a (1 - e^2) / (1 - e^2 sin^2)^1.5 + 37 m = 6379141 m, by 1e-4
  // degrees.
  EXPECT_NEAR(step.y(), 11.1337, 1e-4);
  EXPECT_NEAR(step.x(), 0, 1e-9);
}

struct Walk {
  std::vector<Eigen::Vector3d> centres, positions;
};

Walk MakeWalk(double noise_m, std::uint64_t seed) {
  Random random(seed);
  const Similarity truth{3.0, Eigen::Quaterniond(0.8, 0.2, -0.4, 0.4).normalized(), {5, -7, 90}};
  Walk walk;
  for (int i = 0; i < 30; ++i) {
    walk.centres.emplace_back(0.5 * i, std::sin(0.4 * i), 0.1 * std::cos(0.9 * i));
    walk.positions.push_back(truth * walk.centres.back() + noise_m * Draw(random));
  }
  return walk;
}

TEST(ScaleFromPositions, ExactPositionsGiveTheSimilarity) {
  const Walk walk = MakeWalk(0, 1);
  const PositionScale scale = ScaleFromPositions(walk.centres, walk.positions);
  EXPECT_NEAR(scale.metric_from_scene.scale, 3, 1e-9);
  EXPECT_TRUE(scale.left_out.empty());
}

TEST(ScaleFromPositions, PredictedUncertaintyIsWhatNoiseDoes) {
  double squares = 0;
  constexpr int kSolves = 500;
  for (std::uint64_t k = 0; k < kSolves; ++k) {
    const Walk walk = MakeWalk(0.1, k);
    const PositionScale scale = ScaleFromPositions(walk.centres, walk.positions);
    squares += std::pow((scale.metric_from_scene.scale / 3 - 1) / scale.relative_sigma, 2);
  }
  EXPECT_NEAR(squares / kSolves, 1, 0.2);  // 3 sigmas of the mean of 500
}

TEST(ScaleFromPositions, PositionsThatAreFarOffAreLeftOut) {
  Walk walk = MakeWalk(0.1, 2);
  walk.positions[4] += Eigen::Vector3d(300, 0, 0);
  walk.positions[17] += Eigen::Vector3d(0, -40, 8);
  const PositionScale scale = ScaleFromPositions(walk.centres, walk.positions);
  EXPECT_EQ(scale.left_out, (std::vector<size_t>{4, 17}));
  EXPECT_NEAR(scale.metric_from_scene.scale, 3, 5 * 3 * scale.relative_sigma);
}

TEST(FillUncertainty, EachPositionCountsByItsOwnError) {
  Walk walk = MakeWalk(0, 1);
  std::vector<Eigen::Vector3d> sigmas(30, Eigen::Vector3d(3, 3, 6));
  const auto known = [&] {
    PositionScale scale;
    scale.metric_from_scene.scale = 3;
    FillUncertainty(walk.centres, sigmas, scale);
    return scale;
  };
  const PositionScale alike = known();
  walk.centres.emplace_back(7, 0, 0);
  sigmas.emplace_back(1e4, 1e4, 1e4);
  EXPECT_NEAR(known().relative_sigma / alike.relative_sigma, 1, 1e-3);
  EXPECT_NEAR(known().turn_sigma_rad / alike.turn_sigma_rad, 1, 1e-3);
  sigmas.back() = {0.01, 0.01, 0.01};
  EXPECT_LT(known().relative_sigma, alike.relative_sigma);
  // On a line along x the turn about it is not known, the scale is: sigma over the spread.
  walk.centres = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  sigmas.assign(4, {3, 300, 300});
  EXPECT_GT(known().turn_sigma_rad, 1e3);
  EXPECT_NEAR(known().relative_sigma, 3 / (3 * std::sqrt(5.0)), 1e-9);
}

TEST(AlignToPositions, VaguePositionsTurnAndShiftWhereTheScaleIsKnown) {
  constexpr int kSolves = 300;
  constexpr double kVagueM = 14;  // of a walk of 44 m
  double squares = 0;
  for (std::uint64_t k = 0; k < kSolves; ++k) {
    const Walk exact = MakeWalk(0, k), vague = MakeWalk(kVagueM, k);
    EXPECT_THROW(ScaleFromPositions(vague.centres, vague.positions), Error) << k;
    const PositionScale scale = AlignToPositions(vague.centres, vague.positions, 3.0);
    EXPECT_EQ(scale.metric_from_scene.scale, 3);
    // The middle is the mean of 30 places, wherever the turn is.
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < exact.centres.size(); ++i) {
      shift += (scale.metric_from_scene * exact.centres[i] - exact.positions[i]) / 30;
    }
    squares += shift.squaredNorm() / (3 * kVagueM * kVagueM / 30);
    EXPECT_TRUE(scale.settled);
  }
  EXPECT_NEAR(squares / kSolves, 1, 0.15);  // 3 sigmas of the mean of 900 squares, halved freedom
}

// Which positions agree is decided by a fit to those that did: that may go round for ever.
TEST(AlignToPositions, PositionsThatTakeTurnsToAgreeAreTold) {
  Random random(1548);  // one of some 60 000 such draws of heavy tails
  std::vector<Eigen::Vector3d> centres, positions;
  for (int i = 0; i < 8; ++i) {
    centres.push_back(Draw(random));
    const double tail = std::abs(random.Normal());
    positions.push_back(centres.back() + 0.03 * Draw(random) / tail);
  }
  const PositionScale scale = AlignToPositions(centres, positions);
  EXPECT_FALSE(scale.settled);
  // What is told is told of one fit all the same: the last.
  std::vector<Eigen::Vector3d> a, b;
  for (size_t i = 0; i < centres.size(); ++i) {
    const auto& out = scale.left_out;
    if (std::find(out.begin(), out.end(), i) != out.end()) continue;
    a.push_back(centres[i]);
    b.push_back(positions[i]);
  }
  EXPECT_EQ(scale.rms_m, AlignmentRms(AlignPoints(a, b), a, b));
}

TEST(AlignToPositions, PositionsOfWhichTooFewAgreeAreRejected) {
  // A triangle, and its middle, which the three hold where it is.
  const std::vector<Eigen::Vector3d> centres = {{2, 0, 0}, {-1, 1.7, 0}, {-1, -1.7, 0}, {0, 0, 0}};
  std::vector<Eigen::Vector3d> positions = centres;
  positions[3].z() = 0.5;
  try {
    (void)AlignToPositions(centres, positions);
    FAIL() << "nothing was rejected";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "scale: expected positions that agree with the cameras, found that 3 of 4 do");
  }
}

TEST(SigmaOfRadius, TwoThirdsOfTheErrorsLieWithinTheRadius) {
  Random random(5);
  constexpr int kDraws = 20000;
  constexpr double kRadiusM = 4.5;
  const double sigma = SigmaOfRadius(kRadiusM);
  int within = 0;
  for (int i = 0; i < kDraws; ++i) within += (sigma * Draw(random)).head<2>().norm() <= kRadiusM;
  EXPECT_NEAR(within, 0.68 * kDraws, 3 * std::sqrt(0.68 * 0.32 * kDraws));
}

TEST(ScaleFromPositions, WhatSaysNothingIsRejected) {
  const Walk vague = MakeWalk(60, 3);
  EXPECT_THROW(ScaleFromPositions(vague.centres, vague.positions), Error);
  Walk line = MakeWalk(0, 4);
  for (size_t i = 0; i < line.centres.size(); ++i) {
    line.centres[i] = Eigen::Vector3d(static_cast<double>(i), 0, 0);
    line.positions[i] = Eigen::Vector3d(0, static_cast<double>(i), 0);
  }
  EXPECT_THROW(ScaleFromPositions(line.centres, line.positions), Error);
  EXPECT_THROW(
      ScaleFromPositions(std::span(line.centres).first(3), std::span(line.positions).first(3)),
      Error);
}

}  // namespace
}  // namespace dtr::calib
