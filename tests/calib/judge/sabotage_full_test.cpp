// The gate in full: 30 spoiled calibrations and 30 honest ones. DTR_SABOTAGE_SEED draws others.
#include "tests/calib/judge/sabotage.h"

namespace dtr::calib {
namespace {

using namespace testing;
constexpr int kCases = 30;

TEST(SabotageFull, AllButOneOfThirtyAreCaughtByTheTestThatIsMeantForThem) {
  Tally tally;
  // Drawn on until 30 are strong enough to count.
  for (int k = 0; tally.sabotages() < kCases && k < 4 * kCases; ++k) {
    JudgeSabotage(static_cast<Sabotage>(k % kSabotages),
                  HashOf(dtr::testing::SabotageSeed(), static_cast<std::uint64_t>(k)) % 1000000,
                  tally);
  }
  std::printf("%d of %d caught, %d not detectable\n", tally.caught, tally.sabotages(),
              tally.not_detectable);
  EXPECT_EQ(tally.sabotages(), kCases);
  EXPECT_GE(tally.caught, kCases - 1);
}

TEST(SabotageFull, AllButOneOfThirtyHonestOnesPass) {
  Tally tally;
  for (std::uint64_t k = 0; k < kCases; ++k) {
    JudgeHonest(HashOf(dtr::testing::SabotageSeed(), 7777, k) % 1000000, tally);
  }
  std::printf("%d of %d pass\n", tally.honest_passed, tally.honest);
  EXPECT_GE(tally.honest_passed, kCases - 1);
}

}  // namespace
}  // namespace dtr::calib
