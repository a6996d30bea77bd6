// What stands still before a camera: found in noisy images that something passes through.
#include "stereo/background.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "dtr/base/random.h"
#include "tests/support/on_threads.h"

namespace dtr::stereo {
namespace {

constexpr int kWidth = 64, kHeight = 40, kSteps = 12;
constexpr int kObject = 10;  // side of the square that moves, and pixels it moves a time step: 5

std::uint8_t Level(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

/// A textured wall; at each time step a bright square stands farther right.
ImageRgb8 Wall(int step, double noise, Random& random) {
  ImageRgb8 image(kWidth, kHeight, 3);
  const int left = 5 * step;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool hit = x >= left && x < left + kObject && y >= 10 && y < 10 + kObject;
      for (int c = 0; c < 3; ++c) {
        const double wall = 110 + 40 * std::sin(0.7 * x + 0.3 * c) * std::cos(0.5 * y);
        const double square = 190 + 30 * std::sin(1.1 * (x - left) + y);
        image(x, y, c) = Level((hit ? square : wall) + noise * random.Normal());
      }
    }
  }
  return image;
}

std::vector<ImageRgb8> Walls(double noise, std::uint64_t seed) {
  Random random(seed);
  std::vector<ImageRgb8> images;
  for (int step = 0; step < kSteps; ++step) images.push_back(Wall(step, noise, random));
  return images;
}

TEST(Background, NoiseIsThatOfTheImagesWhateverMoves) {
  for (const double noise : {0.7, 1.5, 4.0}) {
    const auto images = Walls(noise, 3);
    // Rounding to whole levels adds 1/12 to the variance. Of two images, 160 of 2560 pixels are in
    // blocks that the square leaves or reaches: the median is at most the 0.533 quantile of those
    // that stand still, which is 1.08 times the median. That of 7000 blocks is sure to 1 %.
    const double expected = std::sqrt(noise * noise + 1.0 / 12);
    const double found = NoiseOverTime({images, {}});
    EXPECT_GT(found, 0.98 * expected) << noise;
    EXPECT_LT(found, 1.10 * expected) << noise;
  }
}

TEST(Background, IsTheWallWithoutWhatMoves) {
  const auto images = Walls(1.5, 4);
  const Background background = FindBackground({images, {}});
  Random still(1);
  const ImageRgb8 wall = Wall(-100, 0, still);
  double squares = 0;
  int known = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (background.support(x, y) == 0) continue;
      ++known;
      for (int c = 0; c < 3; ++c) {
        squares += std::pow(background.image(x, y, c) - wall(x, y, c), 2) / 3;
      }
    }
  }
  EXPECT_EQ(known, kWidth * kHeight);
  // The mean of about ten images has a third of their noise.
  EXPECT_LT(std::sqrt(squares / known), 0.75);
}

TEST(Background, ChangedIsWhatWindowsWithTheObjectShow) {
  const auto images = Walls(1.5, 5);
  const Background background = FindBackground({images, {}});
  int missed = 0, false_alarms = 0, far = 0;
  for (int step = 0; step < kSteps; ++step) {
    const Mask changed = ChangedPixels(images[static_cast<size_t>(step)], {}, background);
    const int left = 5 * step;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const int dx = std::max({left - x, x - (left + kObject - 1), 0});
        const int dy = std::max({10 - y, y - (10 + kObject - 1), 0});
        if (dx == 0 && dy == 0 && x >= 0) missed += changed(x, y) == 0;
        if (std::max(dx, dy) <= 3) continue;  // windows that reach the object
        ++far;
        false_alarms += changed(x, y) != 0;
      }
    }
  }
  EXPECT_EQ(missed, 0);
  // Six standard deviations and a fifth: never, in the 25 000 windows there are.
  EXPECT_EQ(false_alarms, 0) << far;
}

TEST(Background, PixelsThatShowSomethingElseEveryTimeAreUnknownAndChanged) {
  std::vector<ImageRgb8> images;
  for (int step = 0; step < kSteps; ++step) {
    ImageRgb8 image(kWidth, kHeight, 3, 100);
    for (int c = 0; c < 3; ++c) image(30, 20, c) = Level(20.0 * step);
    images.push_back(image);
  }
  const Background background = FindBackground({images, {}});
  EXPECT_EQ(background.support(30, 20), 0);
  EXPECT_EQ(background.support(40, 20), kSteps);
  const Mask changed = ChangedPixels(images.front(), {}, background);
  EXPECT_NE(changed(30, 20), 0);
  EXPECT_NE(changed(33, 23), 0);  // its window holds that pixel
  EXPECT_EQ(changed(34, 20), 0);
}

TEST(Background, MaskedPixelsSayNothing) {
  const auto images = Walls(0.5, 6);
  std::vector<Mask> masks(images.size(), Mask(kWidth, kHeight, 1, 255));
  for (Mask& mask : masks) mask(8, 8) = 0;
  const Background background = FindBackground({images, masks});
  EXPECT_EQ(background.support(8, 8), 0);
  Mask usable(kWidth, kHeight, 1, 255);
  usable(8, 8) = 0;
  Random random(1);
  const Mask changed = ChangedPixels(Wall(-100, 0.5, random), usable, background);
  EXPECT_EQ(changed(8, 8), 0);
}

TEST(Background, DoesNotDependOnThreads) {
  const auto images = Walls(2, 7);
  const Background one = OnThreads(1,
                                   [&] {
                                     return FindBackground({images, {}});
                                   }),
                   four = OnThreads(4, [&] {
                     return FindBackground({images, {}});
                   });
  EXPECT_EQ(one.image, four.image);
  EXPECT_EQ(one.support, four.support);
  EXPECT_EQ(one.noise, four.noise);
  EXPECT_EQ(OnThreads(1, [&] { return ChangedPixels(images[3], {}, one); }),
            OnThreads(4, [&] { return ChangedPixels(images[3], {}, one); }));
}

TEST(Background, RejectsImagesThatDoNotGoTogether) {
  std::vector<ImageRgb8> images{ImageRgb8(8, 8, 3), ImageRgb8(8, 9, 3)};
  EXPECT_THROW(FindBackground({images, {}}), std::invalid_argument);
  images.clear();
  EXPECT_THROW(FindBackground({images, {}}), std::invalid_argument);
}

}  // namespace
}  // namespace dtr::stereo
