// SPEC 4.8: what a view keeps of its weight near the rim of its photo.
#include "dtr/render/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dtr/base/random.h"

namespace dtr {
namespace {

View Grey(int width_px, int height_px) {
  View view;
  view.camera = PinholeCamera(width_px, height_px, 50, 50, width_px / 2.0, height_px / 2.0);
  view.image = ImageRgb8(width_px, height_px, 3, 90);
  return view;
}

TEST(RimFactors, RiseFromTheOutermostPixelsOverEightPixelsOfASmallPhoto) {
  const Grid<std::uint8_t> factors = RimFactors(Grey(64, 40));
  for (int steps = 0; steps < 20; ++steps) {
    const int expected = steps == 0 ? 1 : std::min(255, (255 * steps + 4) / 8);
    EXPECT_EQ(factors(steps, 20), expected) << steps;
    EXPECT_EQ(factors(63 - steps, 20), expected) << steps;
    EXPECT_EQ(factors(32, steps), expected) << steps;
    EXPECT_EQ(factors(32, 39 - steps), expected) << steps;
  }
  EXPECT_EQ(factors(3, 5), factors(3, 20));  // the nearer rim decides
}

TEST(RimFactors, AreAsWideAsA48thOfALargePhoto) {
  const Grid<std::uint8_t> factors = RimFactors(Grey(960, 100));
  EXPECT_LT(factors(19, 50), 255);
  EXPECT_EQ(factors(20, 50), 255);
}

TEST(RimFactors, MaskedPixelsAreARimToo) {
  View view = Grey(64, 40);
  view.mask = Mask(64, 40, 1, 255);
  Random random(4);
  for (int k = 0; k < 12; ++k) view.mask(random.Index(64), random.Index(40)) = 0;
  const Grid<std::uint8_t> factors = RimFactors(view);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 64; ++x) {
      int nearest = 9;  // chessboard distance to what is masked or off the photo
      for (int j = -1; j <= 40; ++j) {
        for (int i = -1; i <= 64; ++i) {
          if (view.mask.Contains(i, j) && view.mask(i, j) != 0) continue;
          nearest = std::min(nearest, std::max(std::abs(i - x), std::abs(j - y)));
        }
      }
      const int expected = nearest == 0 ? 0 : nearest == 1 ? 1 : (255 * (nearest - 1) + 4) / 8;
      ASSERT_EQ(factors(x, y), std::min(255, expected)) << x << " " << y;
    }
  }
}

TEST(RimFactorAt, IsBilinearAndNeverZero) {
  Grid<std::uint8_t> factors(3, 2);
  factors(0, 0) = 51, factors(1, 0) = 255, factors(0, 1) = 51, factors(1, 1) = 255;
  EXPECT_DOUBLE_EQ(RimFactorAt(factors, {1.0, 0.7}), 0.6);
  EXPECT_DOUBLE_EQ(RimFactorAt(factors, {0, 0}), 0.2);
  EXPECT_DOUBLE_EQ(RimFactorAt(factors, {2.9, 1}), 1.0 / 255);
}

TEST(FadingOf, AtTheViewsOwnPlaceNothingFadesAndFarAwayAllOfTheRim) {
  const View view = Grey(64, 40);  // a rim of 8 pixels
  for (const double rim : {1.0 / 255, 0.5, 1.0}) {
    EXPECT_EQ(FadingOf(view, 0).Of(rim), 1) << rim;
    EXPECT_EQ(FadingOf(view, 2).Of(rim), rim) << "4 pixels a pixel moved: 8";
    EXPECT_EQ(FadingOf(view, std::numeric_limits<double>::infinity()).Of(rim), rim);
  }
  // Moved by a pixel the rim is 4 pixels wide and begins one pixel farther out, minus 1/8.
  for (int steps = 0; steps < 4; ++steps) {
    EXPECT_NEAR(FadingOf(view, 1).Of(steps / 8.0), (steps + 1) / 4.0 - 1.0 / 8, 1e-12) << steps;
  }
  EXPECT_EQ(FadingOf(view, 1).Of(0.5), 1);
}

TEST(FadingOf, ChangesGraduallyWithTheWay) {
  const View view = Grey(960, 100);
  for (int steps = 0; steps < 20; ++steps) {
    double last = 1;
    for (double moved_px = 0; moved_px < 10; moved_px += 0.01) {
      const double factor = FadingOf(view, moved_px).Of(steps / 20.0);
      EXPECT_LE(factor, last);
      EXPECT_LT(last - factor, 0.045) << moved_px;  // 1 / (4 e) falls from 1 at e = 1/4
      last = factor;
    }
    EXPECT_EQ(last, steps / 20.0);
  }
}

}  // namespace
}  // namespace dtr
