// The gate in full: 30 spoiled calibrations and 30 honest ones. DTR_FAULT_SEED draws others.
#include "tests/calib/validation/injected_faults.h"

namespace dtr::calib {
namespace {

using namespace testing;
constexpr int kCases = 30;

TEST(FaultInjectionFull, AllButOneOfThirtyAreCaughtByTheTestThatIsMeantForThem) {
  Tally tally;
  // Drawn on until 30 are strong enough to count.
  for (int k = 0; tally.faults() < kCases && k < 4 * kCases; ++k) {
    ValidateFaultInjection(
        static_cast<FaultInjection>(k % kFaultInjections),
        HashOf(dtr::testing::FaultInjectionSeed(), static_cast<std::uint64_t>(k)) % 1000000, tally);
  }
  std::printf("%d of %d caught, %d not detectable\n", tally.caught, tally.faults(),
              tally.not_detectable);
  EXPECT_EQ(tally.faults(), kCases);
  EXPECT_GE(tally.caught, kCases - 1);
}

TEST(FaultInjectionFull, AllButOneOfThirtyHonestOnesPass) {
  Tally tally;
  for (std::uint64_t k = 0; k < kCases; ++k) {
    ValidateHonest(HashOf(dtr::testing::FaultInjectionSeed(), 7777, k) % 1000000, tally);
  }
  std::printf("%d of %d pass\n", tally.honest_passed, tally.honest);
  EXPECT_GE(tally.honest_passed, kCases - 1);
}

}  // namespace
}  // namespace dtr::calib
