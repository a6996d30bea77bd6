#include "dtr/render/fill_holes.h"

#include <gtest/gtest.h>

#include "dtr/base/random.h"
#include "dtr/render/colour.h"

namespace dtr {
namespace {

RenderResult Blank(int width, int height) {
  RenderResult result;
  result.image = ImageRgb8(width, height, 3);
  result.depth = DepthImage(width, height);
  result.coverage = Mask(width, height);
  result.view_count = Grid<std::uint8_t>(width, height);
  return result;
}

void See(RenderResult& result, int x, int y, std::uint8_t level, float depth) {
  for (int c = 0; c < 3; ++c) result.image(x, y, c) = level;
  result.coverage(x, y) = 255;
  result.depth(x, y) = depth;
}

TEST(FillHoles, NeverChangesWhatWasSeen) {
  Random random(3);
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 9}, {7, 1}, {33, 20}, {64, 64}}) {
    RenderResult result = Blank(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (random.Index(3) != 0) continue;
        See(result, x, y, static_cast<std::uint8_t>(random.Index(256)),
            static_cast<float>(random.Uniform(1, 100)));
      }
    }
    result.coverage_share = 0.25;
    const RenderResult before = result;
    FillHoles(result);
    EXPECT_EQ(result.coverage, before.coverage);
    EXPECT_EQ(result.depth, before.depth);
    EXPECT_EQ(result.view_count, before.view_count);
    EXPECT_EQ(result.coverage_share, 0.25);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (before.coverage(x, y) == 0) continue;
        for (int c = 0; c < 3; ++c) EXPECT_EQ(result.image(x, y, c), before.image(x, y, c));
      }
    }
    RenderResult again = before;
    FillHoles(again);
    EXPECT_EQ(again.image, result.image);
  }
}

TEST(FillHoles, OneColourStaysThatColour) {
  RenderResult result = Blank(40, 30);
  See(result, 3, 4, 77, 5);
  See(result, 30, 20, 77, 50);
  FillHoles(result);
  for (const std::uint8_t level : result.image.data()) EXPECT_EQ(level, 77);
}

TEST(FillHoles, NearAndFarHaveEqualWeights) {
  // Foreground (white, near) left, background (level 20, far) right, a hole in the middle: colours
  // (in linear light) and inverse depths go evenly from one to the other.
  constexpr int kWidth = 48, kHeight = 16;
  RenderResult result = Blank(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 20; ++x) See(result, x, y, 255, 2);
    for (int x = 28; x < kWidth; ++x) See(result, x, y, 20, 20);
  }
  const RenderResult before = result;
  const Grid<float> depth = FillHoles(result);
  EXPECT_EQ(result.depth, before.depth);
  const std::array<double, 256>& linear = LinearFromSrgb8();
  constexpr double kLevel = 0.01;  // of 8 bits, in linear light at white
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (before.coverage(x, y) != 0) {
        EXPECT_EQ(depth(x, y), before.depth(x, y));
        continue;
      }
      const int mirrored = kWidth - 1 - x;
      EXPECT_NEAR(linear[result.image(x, y, 0)] + linear[result.image(mirrored, y, 0)],
                  linear[255] + linear[20], kLevel);
      EXPECT_NEAR(1 / depth(x, y) + 1 / depth(mirrored, y), 1.0 / 2 + 1.0 / 20, 1e-6);
      EXPECT_LE(result.image(x, y, 0), result.image(x - 1, y, 0));
      EXPECT_GE(depth(x, y), depth(x - 1, y));
    }
  }
}

TEST(FillHoles, NothingSeenStaysBlack) {
  RenderResult result = Blank(5, 4);
  const Grid<float> depth = FillHoles(result);
  for (const std::uint8_t level : result.image.data()) EXPECT_EQ(level, 0);
  for (const float z : depth.data()) EXPECT_EQ(z, 0);
}

TEST(Colour, EightBitValuesSurviveLinearLight) {
  for (int v = 0; v < 256; ++v) {
    EXPECT_EQ(Srgb8FromLinear(LinearFromSrgb8()[static_cast<size_t>(v)]), v);
    EXPECT_NEAR(SrgbFromLinear(LinearFromSrgb(v / 255.0)), v / 255.0,
                1e-7);  // the curve's own kink
  }
  for (int i = 1; i < 100000; ++i) {
    const double linear = i / 100000.0;
    EXPECT_EQ(Srgb8FromLinear(linear), Srgb8FromSrgb(SrgbFromLinear(linear))) << linear;
  }
  EXPECT_NEAR(LinearFromSrgb(0.5), 0.21404114048223255, 1e-15);
  EXPECT_EQ(Srgb8FromLinear(std::nan("")), 0);
  EXPECT_EQ(Srgb8FromLinear(-1), 0);
  EXPECT_EQ(Srgb8FromLinear(7), 255);
}

}  // namespace
}  // namespace dtr
