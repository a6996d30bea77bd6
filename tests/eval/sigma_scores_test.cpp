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
  scorer.Add(1, 4, false);  // the right order would be 1, 2, 3
  scorer.Add(3, 1, false);
  scorer.Add(2, 2, false);
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
    normal.Add(std::abs(sigma * random.Normal()), sigma, false);
    ordered.Add(1e-3 * sigma, sigma, false);
  }
  EXPECT_NEAR(*normal.Scores().share_within_1_sigma, 0.683, kShareNoise);
  EXPECT_NEAR(*normal.Scores().share_within_2_sigma, 0.954, kShareNoise);
  EXPECT_NEAR(*ordered.Scores().sparsification_ratio, 1.0, kBinning);
  EXPECT_GT(*normal.Scores().sparsification_ratio, 1.1);
}

TEST(SigmaScorer, WhatNormalErrorsWouldGiveIsWhatTheyGive) {
  SigmaScorer equal, spread, wrong;
  Random random(2);
  for (int i = 0; i < kDraws; ++i) {
    const double sigma = std::exp(random.Normal());
    equal.Add(std::abs(random.Normal()), 1, false);
    spread.Add(std::abs(sigma * random.Normal()), sigma, false);
    // Now and then an error that no sigma tells of: the ratio grows, what sigmas could reach not.
    wrong.Add(i % 50 == 0 ? 100 : std::abs(sigma * random.Normal()), sigma, false);
  }
  // Means of the smallest share q of half-normal errors, and of all, over all q.
  EXPECT_NEAR(*equal.Scores().sparsification_ratio_if_normal, 2.32, 0.02);
  for (const SigmaScorer* honest : {&equal, &spread}) {
    const SigmaScores s = honest->Scores();
    EXPECT_NEAR(*s.sparsification_ratio_if_normal / *s.sparsification_ratio, 1, 0.03);
  }
  EXPECT_NEAR(*wrong.Scores().sparsification_ratio_if_normal,
              *spread.Scores().sparsification_ratio_if_normal, 0.05);
  EXPECT_GT(*wrong.Scores().sparsification_ratio,
            1.5 * *wrong.Scores().sparsification_ratio_if_normal);
}

TEST(SigmaScorer, OutliersAmongTheMostCertain) {
  SigmaScorer scorer;
  EXPECT_TRUE(scorer.Scores().outlier_share_by_tenth.empty());
  // 20 pixels; the two of the largest sigmas are wrong, and one of the first two.
  for (int i = 0; i < 20; ++i) scorer.Add(1, 1 + i, i == 0 || i >= 18);
  const std::vector<double> shares = scorer.Scores().outlier_share_by_tenth;
  ASSERT_EQ(shares.size(), 10u);
  for (size_t tenth = 0; tenth < 9; ++tenth) {
    EXPECT_NEAR(shares[tenth], 1 / (2.0 * static_cast<double>(tenth + 1)), 1e-12) << tenth;
  }
  EXPECT_NEAR(shares[9], 3 / 20.0, 1e-12);

  SigmaScorer alike;  // pixels that sigmas do not tell apart
  for (int i = 0; i < 15; ++i) alike.Add(1, 1, i < 3);
  for (const double share : alike.Scores().outlier_share_by_tenth) EXPECT_NEAR(share, 0.2, 1e-12);
}

TEST(SigmaScorer, NothingToEvaluateGivesNoFigures) {
  SigmaScorer scorer;
  EXPECT_FALSE(scorer.Scores().share_within_1_sigma.has_value());
  scorer.Add(0, 1, false);
  EXPECT_DOUBLE_EQ(*scorer.Scores().share_within_1_sigma, 1.0);
  EXPECT_FALSE(scorer.Scores().sparsification_ratio.has_value());
  EXPECT_THROW(scorer.Add(-1, 1, false), std::invalid_argument);
  EXPECT_THROW(scorer.Add(1, 0, false), std::invalid_argument);
  EXPECT_THROW(scorer.Add(std::nan(""), 1, false), std::invalid_argument);
}

}  // namespace
}  // namespace dtr::eval
