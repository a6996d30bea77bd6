#include <gtest/gtest.h>

#include "tests/calib/bundle/injected_faults.h"

namespace dtr::calib {
namespace {

// 30 sets spoiled at 8 to 40 predicted standard deviations, and the 30 honest ones they come from,
// twice. DTR_FAULT_SEED draws others.
TEST(FaultInjection, AllButOneOfThirtyAreCaughtAndThirtyHonestSetsPass) {
  const std::uint64_t first = testing::FaultInjectionSeed();
  for (const std::uint64_t seed : {first, first + 1}) {
    const testing::Tally score = testing::FaultInjectionAll(30, seed);
    std::cout << "seed " << seed << ": caught " << score.caught << ", missed " << score.missed
              << ", not detectable " << score.not_detectable << ", honest passed "
              << score.honest_passed << "\n";
    EXPECT_LE(score.missed, 1);
    EXPECT_GE(score.honest_passed, 29);
    EXPECT_GE(score.caught, 20);
  }
}

}  // namespace
}  // namespace dtr::calib
