// Are predicted uncertainties true? Known cameras, drawn noise of 0.1 px.
#include "tests/calib/solve/monte_carlo.h"

namespace dtr::calib {
namespace {

using namespace testing;

class MonteCarloQuick : public ::testing::TestWithParam<BoardModel> {};

TEST_P(MonteCarloQuick, PredictedUncertaintyIsWhatNoiseDoes) {
  const MonteCarlo result = RunMonteCarlo(GetParam(), 50, 12, 0.1);
  // 50 solves cannot tell 99 % of one parameter; of all parameters together they can.
  EXPECT_GE(result.all_share, kInsideThreeSigmas);
  EXPECT_GT(result.chi_squared, kMinChiSquared);
  EXPECT_LT(result.chi_squared, kMaxChiSquared);
  EXPECT_NEAR(result.rms_ratio, 1, kSameRms);
}

INSTANTIATE_TEST_SUITE_P(Models, MonteCarloQuick,
                         ::testing::Values(BoardModel::kPinhole, BoardModel::kBrown4,
                                           BoardModel::kBrown5, BoardModel::kFisheye),
                         [](const auto& model) { return NameOf(model.param); });

}  // namespace
}  // namespace dtr::calib
