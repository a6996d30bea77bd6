#include "dtr/eval/depth_truth.h"

#include <gtest/gtest.h>

#include "dtr/base/error.h"

namespace dtr::eval {
namespace {

constexpr double kFloat = 1e-6;  // depths are float32

/// Truth 10 everywhere, 8 pixels; errors 0, 0.5 %, 1.5 %, 3 %, 10 %, a hole, no truth, masked.
struct Worked {
  DepthImage truth{8, 1}, estimate{8, 1};
  Mask scored{8, 1, 1, 255};
  Worked() {
    const float z[8] = {10.0f, 10.05f, 9.85f, 10.3f, 11.0f, 0.0f, 7.0f, 3.0f};
    for (int x = 0; x < 8; ++x) {
      truth(x, 0) = x == 6 ? 0.0f : 10.0f;
      estimate(x, 0) = z[x];
    }
    scored(7, 0) = 0;
  }
};

TEST(DepthScorer, HandWorkedFigures) {
  const Worked w;
  DepthScorer scorer;
  scorer.Add(w.estimate, w.truth, w.scored, 1, 500);  // px = 500 |1/z - 1/10|
  const DepthScores s = scorer.Scores();
  EXPECT_EQ(s.truth_pixels, 6);
  EXPECT_EQ(s.kept_pixels, 5);
  EXPECT_DOUBLE_EQ(*s.share_within_1pct, 2 / 6.0);  // the hole counts as wrong
  EXPECT_DOUBLE_EQ(*s.share_within_2pct, 3 / 6.0);
  EXPECT_DOUBLE_EQ(*s.depth_completeness, 5 / 6.0);
  EXPECT_DOUBLE_EQ(*s.outlier_share, 2 / 5.0);  // of the kept
  EXPECT_DOUBLE_EQ(*s.outlier_share_5pct, 1 / 5.0);
  EXPECT_NEAR(*s.median_relative_error, 0.015, kFloat);
  // Disparity errors: 0, 0.249, 0.761, 1.456, 4.545 px.
  EXPECT_DOUBLE_EQ(*s.share_within_half_px, 2 / 6.0);
  EXPECT_DOUBLE_EQ(*s.share_within_1px, 3 / 6.0);
  EXPECT_DOUBLE_EQ(*s.share_within_2px, 4 / 6.0);
  EXPECT_DOUBLE_EQ(*s.share_estimated_without_truth, 1.0);
}

TEST(DepthScorer, PoolsPixelsOfSeveralMaps) {
  const Worked w;
  DepthScorer scorer;
  scorer.Add(w.estimate, w.truth, w.scored, 1, 500);
  scorer.Add(w.truth, w.truth, {}, 1, 500);  // 7 right ones
  EXPECT_DOUBLE_EQ(*scorer.Scores().share_within_1pct, 9 / 13.0);
}

TEST(DepthScorer, TruthIsScaledToTheSet) {
  const Worked w;
  DepthImage small = w.estimate;
  for (float& z : small.grid().data()) z *= 0.25f;
  DepthScorer scorer, reference;
  scorer.Add(small, w.truth, w.scored, 0.25, 0);
  reference.Add(w.estimate, w.truth, w.scored, 1, 0);
  EXPECT_EQ(*scorer.Scores().share_within_1pct, *reference.Scores().share_within_1pct);
  EXPECT_EQ(*scorer.Scores().outlier_share, *reference.Scores().outlier_share);
  EXPECT_FALSE(scorer.Scores().share_within_1px.has_value());
}

TEST(DepthScorer, EvaluatesStatedSigmasAndSkipsPixelsWithoutOne) {
  const Worked w;
  Grid<float> sigma(8, 1);
  sigma(1, 0) = 1e-3f;  // error 0.0005: inside
  sigma(3, 0) = 2e-3f;  // error 0.0029: outside
  DepthScorer scorer;
  scorer.Add(w.estimate, w.truth, w.scored, 1, 500, &sigma);
  EXPECT_DOUBLE_EQ(*scorer.Scores().sigma.share_within_1_sigma, 1 / 2.0);
  EXPECT_DOUBLE_EQ(*scorer.Scores().sigma.share_within_2_sigma, 1.0);
  const Grid<float> other(4, 1);
  EXPECT_THROW(scorer.Add(w.estimate, w.truth, w.scored, 1, 500, &other), Error);
}

TEST(DepthScorer, NothingToScoreGivesNoFigures) {
  DepthScorer scorer;
  EXPECT_FALSE(scorer.Scores().share_within_1pct.has_value());
  scorer.Add(DepthImage(4, 4), DepthImage(4, 4), {}, 1, 1);
  EXPECT_FALSE(scorer.Scores().depth_completeness.has_value());
  EXPECT_FALSE(scorer.Scores().median_relative_error.has_value());
}

TEST(DepthScorer, OtherGridsAndKindsAreRejected) {
  DepthScorer scorer;
  EXPECT_THROW(scorer.Add(DepthImage(4, 4), DepthImage(8, 8), {}, 1, 1), Error);
  EXPECT_THROW(scorer.Add(DepthImage(4, 4), DepthImage(4, 4), Mask(4, 3), 1, 1), Error);
  EXPECT_THROW(scorer.Add(DepthImage(4, 4), DepthImage(4, 4, DepthKind::kRayDistance), {}, 1, 1),
               Error);
  EXPECT_THROW(scorer.Add(DepthImage(4, 4), DepthImage(4, 4), {}, 0, 1), Error);
  EXPECT_THROW(scorer.Add(DepthImage(4, 4), DepthImage(4, 4), {}, 1, -1), Error);
}

TEST(SubsampleTruth, TakesTheCentrePixelsOfOddScalesOnly) {
  DepthImage truth(9, 6);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 9; ++x) truth(x, y) = static_cast<float>(10 * y + x);
  }
  const DepthImage small = SubsampleTruth(truth, 3);
  ASSERT_EQ(small.width(), 3);
  ASSERT_EQ(small.height(), 2);
  EXPECT_EQ(small(0, 0), 11);  // centre of the first 3x3 block
  EXPECT_EQ(small(2, 1), 47);
  EXPECT_EQ(SubsampleTruth(truth, 1), truth);
  EXPECT_EQ(SubsampleMask(Mask(9, 6, 1, 255), 3), Mask(3, 2, 1, 255));
  EXPECT_THROW(SubsampleTruth(truth, 2), Error);
  EXPECT_THROW(SubsampleTruth(truth, 5), Error);
  EXPECT_THROW(SubsampleTruth(truth, -3), Error);
}

TEST(RequireSameGrid, RejectsTheSmallestResampling) {
  const PinholeCamera camera(640, 480, 500, 500, 320, 240);
  EXPECT_NO_THROW(RequireSameGrid(PinholeCamera(640, 480, 500 + 1e-7, 500, 320, 240), camera, "a"));
  EXPECT_THROW(RequireSameGrid(PinholeCamera(640, 480, 500, 500, 320.5, 240), camera, "a"), Error);
  EXPECT_THROW(RequireSameGrid(PinholeCamera(320, 240, 250, 250, 160, 120), camera, "a"), Error);
}

}  // namespace
}  // namespace dtr::eval
