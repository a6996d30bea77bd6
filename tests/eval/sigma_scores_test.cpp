#include "dtr/eval/sigma_scores.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dtr/base/random.h"

namespace dtr::eval {
namespace {

constexpr int kDraws = 20000;
constexpr double kShareNoise = 0.015;  // 4 standard deviations of a share over kDraws
constexpr double kBinning = 0.01;      // bins of 1/32 octave stand for exact order

TEST(SigmaScorer, HandWorkedFigures) {
  SigmaScorer scorer;
  scorer.Add(1, 4);  // the right order would be 1, 2, 3
  scorer.Add(3, 1);
  scorer.Add(2, 2);
  const SigmaScores s = scorer.Scores();
  EXPECT_DOUBLE_EQ(*s.share_within_1_sigma, 2 / 3.0);
  EXPECT_DOUBLE_EQ(*s.share_within_2_sigma, 2 / 3.0);
  EXPECT_DOUBLE_EQ(*s.share_within_3_sigma, 1.0);
  // Means of what is left, 1, 2, 3 pixels: by sigma 3, 2.5, 2; by error 1, 1.5, 2.
  EXPECT_NEAR(*s.sparsification_ratio, (3 + 2.75 + 2.25) / (1 + 1.25 + 1.75), 1e-12);
}

TEST(SigmaScorer, NormalErrorsGiveTheNormalSharesAndAPerfectOrderARatioOfOne) {
  SigmaScorer normal, ordered;
  Random random(1);
  for (int i = 0; i < kDraws; ++i) {
    const double sigma = std::exp(random.Normal());
    normal.Add(std::abs(sigma * random.Normal()), sigma);
    ordered.Add(1e-3 * sigma, sigma);
  }
  EXPECT_NEAR(*normal.Scores().share_within_1_sigma, 0.683, kShareNoise);
  EXPECT_NEAR(*normal.Scores().share_within_2_sigma, 0.954, kShareNoise);
  EXPECT_NEAR(*ordered.Scores().sparsification_ratio, 1.0, kBinning);
  EXPECT_GT(*normal.Scores().sparsification_ratio, 1.1);
}

TEST(SigmaScorer, NothingToJudgeGivesNoFigures) {
  SigmaScorer scorer;
  EXPECT_FALSE(scorer.Scores().share_within_1_sigma.has_value());
  scorer.Add(0, 1);
  EXPECT_DOUBLE_EQ(*scorer.Scores().share_within_1_sigma, 1.0);
  EXPECT_FALSE(scorer.Scores().sparsification_ratio.has_value());
  EXPECT_THROW(scorer.Add(-1, 1), std::invalid_argument);
  EXPECT_THROW(scorer.Add(1, 0), std::invalid_argument);
  EXPECT_THROW(scorer.Add(std::nan(""), 1), std::invalid_argument);
}

}  // namespace
}  // namespace dtr::eval
