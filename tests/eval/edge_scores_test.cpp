#include "dtr/eval/edge_scores.h"

#include <gtest/gtest.h>

namespace dtr::eval {
namespace {

constexpr int kWidth = 40, kHeight = 6;
constexpr float kNear = 2, kFar = 4;
constexpr double kPx = 40;  // px = 40 |1/z - 1/z'|: the jump has 10

/// Near left of column `edge`, far from there on.
DepthImage Step(int edge) {
  DepthImage depth(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) depth(x, y) = x < edge ? kNear : kFar;
  }
  return depth;
}

EdgeScores Score(const DepthImage& estimate, double scale = 1) {
  EdgeScorer scorer;
  scorer.Add(estimate, Step(20), {}, scale, kPx * scale);
  return scorer.Scores();
}

TEST(EdgeScorer, MeasuresHowFarTheNearSurfaceHasGrown) {
  EXPECT_DOUBLE_EQ(*Score(Step(20)).displacement_px, 0);
  EXPECT_DOUBLE_EQ(*Score(Step(23)).displacement_px, 3);
  EXPECT_DOUBLE_EQ(*Score(Step(23)).fattening_px, 3);
  EXPECT_DOUBLE_EQ(*Score(Step(18)).displacement_px, 2);
  EXPECT_DOUBLE_EQ(*Score(Step(18)).fattening_px, -2);
  EXPECT_DOUBLE_EQ(*Score(Step(18)).found_share, 1);
}

TEST(EdgeScorer, AHoleHasItsEdgeInItsMiddleAndAMissingSurfaceHasNone) {
  DepthImage holes = Step(20);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 20; x < 24; ++x) holes(x, y) = 0;
  }
  EXPECT_DOUBLE_EQ(*Score(holes).displacement_px, 2);
  EXPECT_DOUBLE_EQ(*Score(holes).fattening_px, 2);
  const EdgeScores lost = Score(Step(0));
  EXPECT_DOUBLE_EQ(*lost.found_share, 0);
  EXPECT_FALSE(lost.displacement_px.has_value());
}

TEST(EdgeScorer, OneWrongPixelMovesNoEdge) {
  DepthImage estimate = Step(20);
  for (int y = 0; y < kHeight; ++y) estimate(22, y) = kNear;
  EXPECT_DOUBLE_EQ(*Score(estimate).displacement_px, 0);
}

TEST(EdgeScorer, TruthIsScaledToTheSet) {
  DepthImage big = Step(23);
  for (float& z : big.grid().data()) z *= 8;
  EXPECT_DOUBLE_EQ(*Score(big, 8).displacement_px, 3);
}

TEST(EdgeScorer, SlantedSurfacesAndSmallStepsAreNoEdges) {
  DepthImage slanted(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) slanted(x, y) = 1.0f / (0.2f + 0.01f * static_cast<float>(x));
  }
  EdgeScorer scorer;
  scorer.Add(slanted, slanted, {}, 1, kPx);  // 0.4 px per pixel
  EXPECT_FALSE(scorer.Scores().found_share.has_value());
}

}  // namespace
}  // namespace dtr::eval
