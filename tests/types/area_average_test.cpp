#include "dtr/types/area_average.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <utility>

#include "dtr/base/random.h"

namespace dtr {
namespace {

using Size = std::pair<int, int>;

TEST(TargetSize, LimitsTheLongSideAndRoundsTheShort) {
  EXPECT_EQ(TargetSize(3000, 2000, 0), Size(3000, 2000));
  EXPECT_EQ(TargetSize(3000, 2000, 3000), Size(3000, 2000));
  EXPECT_EQ(TargetSize(3000, 2000, 1000), Size(1000, 667));
  EXPECT_EQ(TargetSize(2000, 3000, 1000), Size(667, 1000));
  EXPECT_EQ(TargetSize(4000, 1, 100), Size(100, 1));
  EXPECT_EQ(TargetSize(2000000000, 1000000000, 1000000001), Size(1000000001, 500000001));
  EXPECT_THROW(TargetSize(0, 10, 5), std::invalid_argument);
  EXPECT_THROW(TargetSize(10, 10, -1), std::invalid_argument);
}

TEST(AreaAverage, HandWorkedThreeToTwo) {
  Grid<std::uint8_t> row(3, 1);
  row(0, 0) = 10;
  row(1, 0) = 40;
  row(2, 0) = 100;
  const auto half = AreaAverage(row, 2, 1);
  EXPECT_EQ(half(0, 0), 20);  // (1 * 10 + 0.5 * 40) / 1.5
  EXPECT_EQ(half(1, 0), 80);  // (0.5 * 40 + 1 * 100) / 1.5
}

TEST(AreaAverage, LinearRampStaysThatRamp) {
  // The mean of a + b x over a rectangle is its value at the centre. Steps of 6 per pixel make
  // every mean a whole number for the ratios used.
  for (const auto& [width, height] : {Size(20, 15), Size(10, 10), Size(8, 6)}) {
    ImageRgb8 ramp(40, 30, 3);
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 40; ++x) {
        for (int c = 0; c < 3; ++c) {
          ramp(x, y, c) = static_cast<std::uint8_t>(c == 0 ? 6 * x : c == 1 ? 6 * y : 7);
        }
      }
    }
    const ImageRgb8 small = AreaAverage(ramp, width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        ASSERT_EQ(small(x, y, 0), (x + 0.5) * 40 / width * 6 - 3);
        ASSERT_EQ(small(x, y, 1), (y + 0.5) * 30 / height * 6 - 3);
        ASSERT_EQ(small(x, y, 2), 7);
      }
    }
  }
}

TEST(AreaAverage, IsTheExactBoxMeanForAnyRatio) {
  Random random(5);
  Grid<std::uint8_t> image(37, 23);
  for (auto& value : image.data()) value = static_cast<std::uint8_t>(random.Index(256));
  for (const auto& [width, height] : {Size(36, 22), Size(13, 11), Size(37, 7), Size(1, 1)}) {
    const auto small = AreaAverage(image, width, height);
    const double sx = 37.0 / width, sy = 23.0 / height;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int j = 0; j < 23; ++j) {
          for (int i = 0; i < 37; ++i) {
            const double wx = std::min<double>(i + 1, (x + 1) * sx) - std::max<double>(i, x * sx);
            const double wy = std::min<double>(j + 1, (y + 1) * sy) - std::max<double>(j, y * sy);
            if (wx > 0 && wy > 0) sum += wx * wy * image(i, j);
          }
        }
        // Half a level of rounding, and the double arithmetic of this test.
        ASSERT_NEAR(small(x, y), sum / (sx * sy), 0.5 + 1e-9);
      }
    }
  }
}

TEST(AreaAverage, EqualSizeIsTheSameImageAndEnlargingIsRejected) {
  Random random(6);
  ImageRgb8 image(9, 7, 3);
  for (auto& value : image.data()) value = static_cast<std::uint8_t>(random.Index(256));
  EXPECT_EQ(AreaAverage(image, 9, 7), image);
  EXPECT_THROW(AreaAverage(image, 10, 7), std::invalid_argument);
  EXPECT_THROW(AreaAverage(image, 9, 0), std::invalid_argument);
}

TEST(ShrinkMask, APixelThatTouchesAMaskedOneIsMasked) {
  Mask mask(6, 3, 1, 255);
  mask(2, 0) = 0;
  const Mask thirds = ShrinkMask(mask, 2, 1);  // pixels [0, 3) and [3, 6)
  EXPECT_EQ(thirds(0, 0), 0);
  EXPECT_EQ(thirds(1, 0), 255);
  const Mask quarters = ShrinkMask(mask, 4, 3);  // pixel 1 is [1.5, 3), pixel 2 is [3, 4.5)
  EXPECT_EQ(quarters(0, 0), 255);
  EXPECT_EQ(quarters(1, 0), 0);
  EXPECT_EQ(quarters(2, 0), 255);
  EXPECT_EQ(quarters(1, 1), 255);
}

}  // namespace
}  // namespace dtr
