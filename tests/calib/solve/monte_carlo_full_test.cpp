// Predicted uncertainties in full: 1000 solves (or DTR_MONTE_CARLO_SOLVES), every parameter on its
// own.
#include <cstdlib>

#include "tests/calib/solve/monte_carlo.h"

namespace dtr::calib {
namespace {

using namespace testing;

int Solves() {
  const char* given = std::getenv("DTR_MONTE_CARLO_SOLVES");
  return given ? std::atoi(given) : 1000;
}

class MonteCarloFull : public ::testing::TestWithParam<BoardModel> {};

TEST_P(MonteCarloFull, PredictedUncertaintyIsWhatNoiseDoes) {
  const MonteCarlo result = RunMonteCarlo(GetParam(), Solves(), 12, 0.1);
  EXPECT_GE(result.worst_share, kInsideThreeSigmas);
  for (const double chi_squared : {result.chi_squared, result.lens_chi_squared}) {
    EXPECT_GT(chi_squared, kMinChiSquared);
    EXPECT_LT(chi_squared, kMaxChiSquared);
  }
  EXPECT_NEAR(result.rms_ratio, 1, kSameRms);
}

INSTANTIATE_TEST_SUITE_P(Models, MonteCarloFull,
                         ::testing::Values(BoardModel::kPinhole, BoardModel::kBrown4,
                                           BoardModel::kBrown5, BoardModel::kFisheye),
                         [](const auto& model) { return NameOf(model.param); });

}  // namespace
}  // namespace dtr::calib
