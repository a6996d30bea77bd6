#include "calib/distributions.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dtr::calib {
namespace {

// Values with closed forms: chi-squared of 2 and 4 degrees, F of 2 above; and tables (Abramowitz &
// Stegun, 26.8 and 26.9).
TEST(Distributions, ChiSquaredHasItsClosedForms) {
  for (const double x : {0.1, 1.0, 7.0, 40.0, 300.0}) {
    EXPECT_NEAR(ChiSquaredSurvival(x, 2) / std::exp(-x / 2), 1, 1e-10) << x;
    EXPECT_NEAR(ChiSquaredSurvival(x, 4) / (std::exp(-x / 2) * (1 + x / 2)), 1, 1e-10) << x;
  }
  EXPECT_NEAR(ChiSquaredSurvival(18.307, 10), 0.05, 1e-5);
  EXPECT_NEAR(ChiSquaredSurvival(1, 1), std::erfc(std::sqrt(0.5)), 1e-12);
  EXPECT_EQ(ChiSquaredSurvival(0, 3), 1);
  EXPECT_TRUE(std::isnan(ChiSquaredSurvival(std::nan(""), 3)));
}

TEST(Distributions, FishersFHasItsClosedForms) {
  for (const double x : {0.01, 1.0, 5.0, 80.0}) {
    for (const double below : {3.0, 20.0, 1400.0}) {
      const double exact = std::pow(1 + 2 * x / below, -below / 2);
      EXPECT_NEAR(FisherSurvival(x, 2, below) / exact, 1, 1e-9) << x << " " << below;
    }
  }
  EXPECT_NEAR(FisherSurvival(2.53, 9, 17), 0.0475, 2e-3);
  EXPECT_NEAR(FisherSurvival(1, 50, 50), 0.5, 1e-12);
}

TEST(Distributions, TheLimitIsTheInverse) {
  for (const double p : {0.5, 1e-2, 1e-4, 1e-9}) {
    for (const double freedom : {1.0, 8.0, 120.0}) {
      EXPECT_NEAR(ChiSquaredSurvival(ChiSquaredLimit(p, freedom), freedom) / p, 1, 1e-8);
    }
  }
}

TEST(Distributions, AVarianceThatIsNoNumberHasNoRootOfZero) {
  EXPECT_EQ(RootOfVariance(4), 2);
  EXPECT_EQ(RootOfVariance(-1e-20), 0);
  EXPECT_TRUE(std::isnan(RootOfVariance(std::numeric_limits<double>::quiet_NaN())));
}

}  // namespace
}  // namespace dtr::calib
