#include "viewer/frame_rate_controller.h"

#include <gtest/gtest.h>

#include <set>

namespace dtr::viewer {
namespace {

constexpr double kTargetMs = 60;

/// Draws `frames` frames on a machine that takes `whole_ms` for an image in full and `fixed_ms`
/// for a frame of no size at all; returns the divisors of the last quarter.
std::set<int> Settle(ResolutionFrameRateController& controller, double whole_ms, double fixed_ms,
                     int frames = 200) {
  std::set<int> last;
  for (int frame = 0; frame < frames; ++frame) {
    const int divisor = controller.divisor();
    controller.Drawn(divisor, fixed_ms + whole_ms / (divisor * divisor));
    if (frame >= frames - frames / 4) last.insert(controller.divisor());
  }
  return last;
}

TEST(ResolutionFrameRateController, FindsTheLargestPictureThatIsFastEnoughAndStaysThere) {
  for (const auto& [whole_ms, fixed_ms, expected] :
       {std::tuple(20.0, 5.0, 1), {100.0, 5.0, 2}, {300.0, 5.0, 3}, {900.0, 10.0, 5}}) {
    ResolutionFrameRateController controller(kTargetMs);
    EXPECT_EQ(Settle(controller, whole_ms, fixed_ms), std::set<int>{expected}) << whole_ms;
  }
}

TEST(ResolutionFrameRateController, NeverGoesBelowTheLeastSizeAskedFor) {
  for (const int most : {1, 2, 5}) {
    ResolutionFrameRateController controller(kTargetMs, most);
    EXPECT_LE(controller.divisor(), most);
    EXPECT_EQ(Settle(controller, 1e6, 5), std::set<int>{most});
  }
}

TEST(ResolutionFrameRateController, HoldsTheTargetWhereAnyPictureCan) {
  for (double whole_ms = 10; whole_ms < 3000; whole_ms *= 1.3) {
    ResolutionFrameRateController controller(kTargetMs);
    for (const int divisor : Settle(controller, whole_ms, 3)) {
      EXPECT_LE(3 + whole_ms / (divisor * divisor), kTargetMs) << whole_ms;
    }
  }
}

TEST(ResolutionFrameRateController, FollowsALoadThatChanges) {
  ResolutionFrameRateController controller(kTargetMs);
  Settle(controller, 20, 5);
  EXPECT_EQ(controller.divisor(), 1);
  Settle(controller, 2000, 5, 10);
  EXPECT_GE(controller.divisor(), 6);
  Settle(controller, 20, 5, 400);
  EXPECT_EQ(controller.divisor(), 1);
}

TEST(ResolutionFrameRateController, NeverLeavesItsRange) {
  ResolutionFrameRateController controller(kTargetMs);
  Settle(controller, 1e9, 1e9);
  EXPECT_EQ(controller.divisor(), ResolutionFrameRateController::kMaxDivisor);
  Settle(controller, 0, 0, 1000);
  EXPECT_EQ(controller.divisor(), 1);
}

}  // namespace
}  // namespace dtr::viewer
