// Which settings fit into a number of seconds, given what work costs.
#include "pipeline/core/depth/time_budget.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace dtr::pipeline {
namespace {

// About what a core of a Xeon takes.
constexpr ProbedCosts kCosts{.search_s = 4e-7, .pass_s = 4e-7, .check_s = 1.5e-7};

std::vector<stereo::StereoView> Views(int count) {
  return std::vector<stereo::StereoView>(
      static_cast<size_t>(count),
      {PinholeCamera(1000, 600, 900, 900, 500, 300), Pose{}, nullptr, nullptr});
}

DepthChoice Within(double seconds) {
  DepthChoice choice;
  choice.time_budget_s = seconds;
  return choice;
}

TEST(TimeBudget, TheLadderRisesAndHoldsThePresets) {
  const auto views = Views(16);
  double before = 0;
  for (const stereo::QualitySettings& quality : QualityLadder()) {
    const double seconds = PredictSeconds(kCosts, quality, views);
    EXPECT_GT(seconds, before);
    before = seconds;
  }
  for (const Preset& preset : Presets()) {
    EXPECT_EQ(std::count(QualityLadder().begin(), QualityLadder().end(), preset.quality), 1)
        << preset.name;
  }
}

TEST(TimeBudget, PicksTheMostThatFits) {
  const auto views = Views(16);
  const auto ladder = QualityLadder();
  for (size_t i = 0; i < ladder.size(); ++i) {
    const double seconds = PredictSeconds(kCosts, ladder[i], views);
    EXPECT_EQ(PickQuality(kCosts, Within(1.001 * seconds), views), ladder[i]);
    EXPECT_EQ(PickQuality(kCosts, Within(0.999 * seconds), views), ladder[i == 0 ? 0 : i - 1]);
  }
  EXPECT_EQ(PickQuality(kCosts, Within(1e9), views), ladder.back());
}

TEST(TimeBudget, WhatIsGivenExplicitlyStays) {
  DepthChoice choice = Within(1e9);
  choice.passes = 1;
  EXPECT_EQ(PickQuality(kCosts, choice, Views(4)).passes, 1);
}

TEST(TimeBudget, TwiceThePixelsOrViewsTakeTwiceAsLong) {
  const stereo::QualitySettings quality;
  const double once = PredictSeconds(kCosts, quality, Views(16));
  EXPECT_NEAR(PredictSeconds(kCosts, quality, Views(32)), 2 * once, 1e-9 * once);
  // Two views have one neighbour each, however many are asked for.
  const stereo::QualitySettings one{.neighbours = 1, .pass_neighbours = 1};
  EXPECT_EQ(PredictSeconds(kCosts, quality, Views(2)), PredictSeconds(kCosts, one, Views(2)));
}

TEST(TimeBudget, VisitsByHand) {
  EXPECT_DOUBLE_EQ(VisitsPerPixel(3, 1), 11);  // 3 + 2, and the first guess
  EXPECT_DOUBLE_EQ(VisitsPerPixel(3, 3), 1 + 3 / 4.0 + 11 / 16.0);
  EXPECT_DOUBLE_EQ(VisitsPerPixel(5, 2), 3 + 13 / 4.0);
}

}  // namespace
}  // namespace dtr::pipeline
