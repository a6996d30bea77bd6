#include "viewer/frame_rate_controller.h"

#include <gtest/gtest.h>

#include <set>

namespace dtr::viewer {
namespace {

constexpr double kTargetMs = 60;

/// Draws `frames` frames on a machine that takes `whole_ms` for an image in full and `fixed_ms`
/// for a frame of no size at all; returns the divisors of the last quarter.
std::set<int> Settle(ResolutionFrameRateController& governor, double whole_ms, double fixed_ms,
                     int frames = 200) {
  std::set<int> last;
  for (int frame = 0; frame < frames; ++frame) {
    const int divisor = governor.divisor();
    governor.Drawn(divisor, fixed_ms + whole_ms / (divisor * divisor));
    if (frame >= frames - frames / 4) last.insert(governor.divisor());
  }
  return last;
}

TEST(ResolutionFrameRateController, FindsTheLargestPictureThatIsFastEnoughAndStaysThere) {
  for (const auto& [whole_ms, fixed_ms, expected] :
       {std::tuple(20.0, 5.0, 1), {100.0, 5.0, 2}, {300.0, 5.0, 3}, {900.0, 10.0, 5}}) {
    ResolutionFrameRateController governor(kTargetMs);
    EXPECT_EQ(Settle(governor, whole_ms, fixed_ms), std::set<int>{expected}) << whole_ms;
  }
}

TEST(ResolutionFrameRateController, NeverGoesBelowTheLeastSizeAskedFor) {
  for (const int most : {1, 2, 5}) {
    ResolutionFrameRateController governor(kTargetMs, most);
    EXPECT_LE(governor.divisor(), most);
    EXPECT_EQ(Settle(governor, 1e6, 5), std::set<int>{most});
  }
}

TEST(ResolutionFrameRateController, HoldsTheTargetWhereAnyPictureCan) {
  for (double whole_ms = 10; whole_ms < 3000; whole_ms *= 1.3) {
    ResolutionFrameRateController governor(kTargetMs);
    for (const int divisor : Settle(governor, whole_ms, 3)) {
      EXPECT_LE(3 + whole_ms / (divisor * divisor), kTargetMs) << whole_ms;
    }
  }
}

TEST(ResolutionFrameRateController, FollowsALoadThatChanges) {
  ResolutionFrameRateController governor(kTargetMs);
  Settle(governor, 20, 5);
  EXPECT_EQ(governor.divisor(), 1);
  Settle(governor, 2000, 5, 10);
  EXPECT_GE(governor.divisor(), 6);
  Settle(governor, 20, 5, 400);
  EXPECT_EQ(governor.divisor(), 1);
}

TEST(ResolutionFrameRateController, NeverLeavesItsRange) {
  ResolutionFrameRateController governor(kTargetMs);
  Settle(governor, 1e9, 1e9);
  EXPECT_EQ(governor.divisor(), ResolutionFrameRateController::kMaxDivisor);
  Settle(governor, 0, 0, 1000);
  EXPECT_EQ(governor.divisor(), 1);
}

}  // namespace
}  // namespace dtr::viewer
