#include "dtr/simd/window_depth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/instruction_sets.h"

namespace dtr::simd {
namespace {

// Near 0.5, far 100 by OpenGL's usual projection: device z = (f + n) / (f - n) - 2 f n / (f - n) /
// z.
constexpr double kNear = 0.5, kFar = 100;

WindowDepthMapping Usual() {
  WindowDepthMapping mapping;
  mapping.at_infinity = static_cast<float>((kFar + kNear) / (kFar - kNear));
  mapping.per_inverse_depth = static_cast<float>(-2 * kFar * kNear / (kFar - kNear));
  return mapping;
}

double WindowOf(double z) {
  const double device = (kFar + kNear - 2 * kFar * kNear / z) / (kFar - kNear);
  return 0.5 * (device + 1);
}

const float kInfinity = std::numeric_limits<float>::infinity();

// Any number of pixels: what is left of a register is another path.
TEST(MapToWindow, IsTheProjectionForEveryCountOnEveryInstructionSet) {
  const std::vector<float> some = {0.5001f, 0.6f, 1, 3, 50, 99.9f, 0, 0.4f, 101, kInfinity};
  testing::WithEachInstructionSet([&](std::int64_t) {
    for (size_t count = 0; count <= 35; ++count) {
      std::vector<float> z, found(count, 7);
      for (size_t i = 0; i < count; ++i) z.push_back(some[i % some.size()]);
      MapToWindow(Usual(), z, {}, found);
      for (size_t i = 0; i < count; ++i) {
        const bool drawn = z[i] > kNear && z[i] < kFar;
        if (drawn) {
          EXPECT_NEAR(found[i], WindowOf(z[i]), 2e-7) << count << " " << i;
        } else {
          EXPECT_EQ(found[i], kNoWindowDepth) << count << " " << i;
        }
      }
    }
  });
}

// Of a buffer of 24 bits: rounding to the next step begins at half of one.
constexpr float kStep = 1.0f / ((1 << 24) - 1);

TEST(MapToWindow, FilledPixelsLieBeforeWhatIsClearedToTheFarPlane) {
  const std::vector<float> z = {1e-3f, 1, 99, 1e9f, kInfinity, 0, 1e-40f};
  testing::WithEachInstructionSet([&](std::int64_t) {
    std::vector<float> found(z.size());
    MapToWindow(Usual(), z, std::vector<std::uint8_t>(z.size(), 1), found);
    EXPECT_NEAR(found[0], 0, 3 * kStep) << "before the near plane";
    for (const size_t far : {size_t{3}, size_t{4}}) {
      EXPECT_LT(found[far], 1 - 0.5f * kStep);
      EXPECT_GT(found[far], found[2]);
    }
    EXPECT_EQ(found[5], kNoWindowDepth) << "a hole stays one";
    EXPECT_NEAR(found[6], 0, 3 * kStep) << "denormal, but a depth";
    std::vector<float> not_filled(z.size());
    MapToWindow(Usual(), z, std::vector<std::uint8_t>(z.size(), 0), not_filled);
    EXPECT_EQ(not_filled[3], kNoWindowDepth) << "what is seen is cut off";
  });
}

// Window z 1 is the near plane, 0 lies at infinity or at a far plane; the buffer is cleared to 0
// and what is greater is drawn.
TEST(MapToWindow, FilledPixelsBeyondAReversedProjectionAreNotHiddenByWhatIsCleared) {
  WindowDepthMapping to_infinity, to_far;
  to_infinity.least = to_far.least = 0, to_infinity.scale = to_far.scale = 1;
  to_infinity.at_infinity = 0, to_infinity.per_inverse_depth = static_cast<float>(kNear);
  to_far.at_infinity = static_cast<float>(-kNear / (kFar - kNear));
  to_far.per_inverse_depth = static_cast<float>(kNear * kFar / (kFar - kNear));
  const std::vector<float> z = {1e-3f, 1, 99, 1e12f, kInfinity};
  for (const WindowDepthMapping& mapping : {to_infinity, to_far}) {
    testing::WithEachInstructionSet([&](std::int64_t) {
      std::vector<float> found(z.size());
      MapToWindow(mapping, z, std::vector<std::uint8_t>(z.size(), 1), found);
      EXPECT_NEAR(found[0], 1, 3 * kStep);
      for (const size_t far : {size_t{3}, size_t{4}}) {
        EXPECT_GT(found[far], 0.5f * kStep);
        EXPECT_LT(found[far], found[2]);
      }
    });
  }
}

TEST(MapToWindow, TheHostsDepthRangeAndClampingHold) {
  WindowDepthMapping mapping = Usual();
  mapping.near = 1, mapping.difference = -0.75f;  // glDepthRange(1, 0.25)
  mapping.clamps = true;
  const std::vector<float> z = {0.1f, 1, 1000};
  testing::WithEachInstructionSet([&](std::int64_t) {
    std::vector<float> found(z.size());
    MapToWindow(mapping, z, {}, found);
    EXPECT_EQ(found[0], 1);
    EXPECT_NEAR(found[1], 1 - 0.75 * WindowOf(1), 2e-7);
    EXPECT_EQ(found[2], 0.25f);
  });
}

}  // namespace
}  // namespace dtr::simd
