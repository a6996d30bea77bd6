#include "dtr/eval/metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/quality/qualityssim.hpp>

#include "dtr/base/random.h"
#include "tests/support/on_threads.h"

namespace dtr::eval {
namespace {

constexpr double kClosedForm = 1e-12;  // double arithmetic on integers below 2^40
constexpr double kOpenCvSsim = 2e-5;   // OpenCV filters in float; -7e-8 seen

ImageRgb8 RandomImage(int width, int height, std::uint64_t seed) {
  Random random(seed);
  ImageRgb8 image(width, height, 3);
  for (auto& v : image.data()) v = static_cast<std::uint8_t>(random.Index(256));
  return image;
}

/// A smooth image and a noisy copy: SSIM strictly between 0 and 1.
std::pair<ImageRgb8, ImageRgb8> NoisyPair(int width, int height) {
  Random random(5);
  ImageRgb8 clean(width, height, 3), noisy(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double v = 128 + 60 * std::sin(0.2 * x + c) + 50 * std::cos(0.13 * y * (c + 1));
        clean(x, y, c) = static_cast<std::uint8_t>(v);
        noisy(x, y, c) =
            static_cast<std::uint8_t>(std::clamp(v + 12 * random.Normal(), 0.0, 255.0));
      }
    }
  }
  return {clean, noisy};
}

TEST(Psnr, HandWorkedUniformDifference) {
  const ImageRgb8 a(7, 5, 3, 100), b(7, 5, 3, 110);
  EXPECT_NEAR(*Psnr(a, b, {}), 20 * std::log10(25.5), kClosedForm);  // MSE 100
}

TEST(Psnr, PoolsChannelsBeforeTheLogarithm) {
  const ImageRgb8 a(4, 4, 3, 50);
  ImageRgb8 b = a;
  b(0, 0, 1) = 98;  // one of 48 samples differs by 48: MSE 48
  EXPECT_NEAR(*Psnr(a, b, {}), 10 * std::log10(255.0 * 255.0 / 48.0), kClosedForm);
}

TEST(Psnr, MaskedPixelsDoNotCount) {
  const ImageRgb8 a(4, 4, 3, 50);
  ImageRgb8 b(4, 4, 3, 52);
  b(3, 3, 0) = 255;
  Mask mask(4, 4, 1, 255);
  mask(3, 3) = 0;
  EXPECT_NEAR(*Psnr(a, b, mask), 20 * std::log10(127.5), kClosedForm);
}

TEST(Psnr, IdenticalIsInfiniteAndNothingIsEmpty) {
  const ImageRgb8 a = RandomImage(9, 6, 1);
  EXPECT_TRUE(std::isinf(*Psnr(a, a, {})));
  EXPECT_FALSE(Psnr(a, a, Mask(9, 6)).has_value());
}

TEST(ColourCorrectedPsnr, GainAndOffsetOfAChannelAreNoError) {
  ImageRgb8 a(40, 30, 3), b(40, 30, 3);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) {
        a(x, y, c) = static_cast<std::uint8_t>(2 * x + y + 7 * c);
        b(x, y, c) = static_cast<std::uint8_t>(2 * a(x, y, c) + 5 * c);
      }
    }
  }
  EXPECT_GT(ColourCorrectedPsnr(a, b, {}), 150);  // rounding of sums alone
  EXPECT_LT(*Psnr(a, b, {}), 20);
  b(3, 4, 1) = static_cast<std::uint8_t>(b(3, 4, 1) + 30);  // which no gain explains
  EXPECT_NEAR(*ColourCorrectedPsnr(a, b, {}), 10 * std::log10(255.0 * 255 * 3600 / 900), 0.05);
  Mask mask(40, 30, 1, 255);
  mask(3, 4) = 0;
  EXPECT_GT(ColourCorrectedPsnr(a, b, mask), 150);
}

TEST(ColourCorrectedPsnr, ConstantImagesAndEqualOnes) {
  const ImageRgb8 flat(6, 6, 3, 90), other(6, 6, 3, 120), random = RandomImage(9, 6, 2);
  EXPECT_TRUE(std::isinf(*ColourCorrectedPsnr(flat, other, {})));  // an offset is all
  EXPECT_TRUE(std::isinf(*ColourCorrectedPsnr(random, random, {})));
  EXPECT_FALSE(ColourCorrectedPsnr(flat, other, Mask(6, 6)).has_value());
  EXPECT_THROW(ColourCorrectedPsnr(flat, random, {}), std::invalid_argument);
}

TEST(Metrics, SizesThatDifferAreRejected) {
  const ImageRgb8 a = RandomImage(20, 20, 1);
  EXPECT_THROW(Psnr(a, RandomImage(20, 21, 1), {}), std::invalid_argument);
  EXPECT_THROW(Psnr(a, a, Mask(19, 20)), std::invalid_argument);
  EXPECT_THROW(Ssim(a, RandomImage(21, 20, 1), {}), std::invalid_argument);
  EXPECT_THROW(Intersect(Mask(2, 2), Mask(3, 2)), std::invalid_argument);
}

TEST(Ssim, HandWorkedConstantImages) {
  // No variance: the index is its luminance term, (2 * 100 * 110 + C1) / (100^2 + 110^2 + C1).
  const double c1 = 2.55 * 2.55;
  EXPECT_NEAR(*Ssim(ImageRgb8(15, 12, 3, 100), ImageRgb8(15, 12, 3, 110), {}),
              (22000 + c1) / (22100 + c1), kClosedForm);  // 3e-14 seen
}

TEST(Ssim, IdenticalIsOneAndImagesBelowTheWindowHaveNone) {
  const ImageRgb8 a = RandomImage(40, 30, 3);
  EXPECT_NEAR(*Ssim(a, a, {}), 1.0, kClosedForm);
  EXPECT_FALSE(Ssim(RandomImage(10, 40, 1), RandomImage(10, 40, 2), {}).has_value());
}

TEST(Ssim, AgreesWithOpenCvAwayFromTheBorder) {
  const auto [clean, noisy] = NoisyPair(64, 48);
  const auto as_mat = [](const ImageRgb8& image) {
    return cv::Mat(image.height(), image.width(), CV_8UC3,
                   const_cast<std::uint8_t*>(image.data().data()));
  };
  cv::Mat map;
  cv::quality::QualitySSIM::compute(as_mat(noisy), as_mat(clean), map);
  // OpenCV reflects at the border and counts it; the reference does not: cut the map.
  const cv::Scalar mean = cv::mean(map(cv::Rect(5, 5, 64 - 10, 48 - 10)));
  const double ours = *Ssim(noisy, clean, {});
  EXPECT_NEAR(ours, (mean[0] + mean[1] + mean[2]) / 3, kOpenCvSsim);
  EXPECT_GT(ours, 0.2);
  EXPECT_LT(ours, 0.95);
}

TEST(Ssim, AMaskRemovesEveryWindowItTouches) {
  const auto [clean, noisy] = NoisyPair(60, 40);
  // The right part is spoiled and masked: what is left must equal the left part alone.
  ImageRgb8 spoiled = noisy, left_clean(30, 40, 3), left_noisy(30, 40, 3);
  Mask mask(60, 40, 1, 255);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) {
      for (int c = 0; c < 3; ++c) {
        if (x >= 30) spoiled(x, y, c) = 0;
        if (x < 30) left_clean(x, y, c) = clean(x, y, c), left_noisy(x, y, c) = noisy(x, y, c);
      }
      if (x >= 30) mask(x, y) = 0;
    }
  }
  EXPECT_NEAR(*Ssim(spoiled, clean, mask), *Ssim(left_noisy, left_clean, {}), kClosedForm);
  EXPECT_FALSE(Ssim(spoiled, clean, Mask(60, 40)).has_value());
}

TEST(Ssim, SameBitsForAnyNumberOfThreads) {
  const auto [clean, noisy] = NoisyPair(57, 43);
  EXPECT_EQ(*OnThreads(1, [&] { return Ssim(noisy, clean, {}); }),
            *OnThreads(3, [&] { return Ssim(noisy, clean, {}); }));
}

TEST(ShareOf, CountsWithinTheOtherMask) {
  Mask seen(4, 1), usable(4, 1, 1, 255);
  seen(0, 0) = seen(1, 0) = 255;
  EXPECT_DOUBLE_EQ(ShareOf(seen, {}), 0.5);
  usable(1, 0) = usable(3, 0) = 0;
  EXPECT_DOUBLE_EQ(ShareOf(seen, usable), 0.5);
  EXPECT_DOUBLE_EQ(ShareOf(seen, Mask(4, 1)), 0.0);
  EXPECT_EQ(Intersect(seen, usable)(0, 0), 255);
  EXPECT_EQ(Intersect(seen, usable)(1, 0), 0);
}

}  // namespace
}  // namespace dtr::eval
