#include "dtr/render/smooth_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "dtr/base/random.h"
#include "dtr/render/colour.h"
#include "tests/support/on_threads.h"

namespace dtr {
namespace {

constexpr int kWidth = 24, kHeight = 16;
const PinholeCamera kNovel(kWidth, kHeight, 20, 20, kWidth / 2.0, kHeight / 2.0);
const std::vector<Eigen::Vector3d> kFarAway{{5, 0, 0}};

struct Painted {
  RenderResult result;

  Painted() : Painted(kWidth, kHeight) {}
  Painted(int width, int height) {
    result.image = ImageRgb8(width, height, 3);
    result.depth = DepthImage(width, height);
    result.coverage = Mask(width, height);
  }
  const ImageRgb8& image() const { return result.image; }
  void Set(int x, int y, std::uint8_t level, float z) {
    for (int c = 0; c < 3; ++c) result.image(x, y, c) = level;
    result.depth(x, y) = z;
    result.coverage(x, y) = 255;
  }
  ImageRgb8 Smoothed(std::span<const Eigen::Vector3d> centres, bool filled = true,
                     int threads = 1) const {
    RenderResult smoothed = result;
    OnThreads(threads, [&] { return SmoothEdges(kNovel, centres, filled, smoothed); });
    EXPECT_EQ(smoothed.depth, result.depth);
    EXPECT_EQ(smoothed.coverage, result.coverage);
    return smoothed.image;
  }
};

/// White at depth 2 left of `column`, black at depth 4 from there on.
Painted Step(int column) {
  Painted painted;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      x < column ? painted.Set(x, y, 255, 2) : painted.Set(x, y, 0, 4);
    }
  }
  return painted;
}

Painted Noise() {
  Random random(5);
  Painted painted;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      painted.Set(x, y, static_cast<std::uint8_t>(random.Index(256)),
                  static_cast<float>(random.Uniform(1, 9)));
    }
  }
  return painted;
}

TEST(SmoothEdges, MixesTheTwoSidesOfADepthEdgeInLinearLight) {
  const Painted painted = Step(10);
  const ImageRgb8 smoothed = painted.Smoothed(kFarAway);
  // Columns weigh 1, 3 and 1: a fifth of the light comes from over the edge.
  EXPECT_EQ(smoothed(9, 8, 0), Srgb8FromLinear(0.8));
  EXPECT_EQ(smoothed(10, 8, 1), Srgb8FromLinear(0.2));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (x == 9 || x == 10) continue;
      EXPECT_EQ(smoothed(x, y), painted.image()(x, y)) << x << ", " << y;
    }
  }
}

TEST(SmoothEdges, LeavesSlantedPlanesAlone) {
  Random random(2);
  for (const double slope : {0.0, 0.2, -0.6}) {
    Painted painted;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double w = 0.5 + slope * (x + 0.5 * y) / (2.0 * kWidth);
        painted.Set(x, y, static_cast<std::uint8_t>(random.Index(256)), static_cast<float>(1 / w));
      }
    }
    EXPECT_EQ(painted.Smoothed(kFarAway), painted.image()) << slope;
  }
}

TEST(SmoothEdges, LeavesThePhotoAloneAtItsOwnPlace) {
  const Painted painted = Noise();
  const std::vector<Eigen::Vector3d> centres{{5, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(painted.Smoothed(centres), painted.image());
  EXPECT_NE(painted.Smoothed(kFarAway), painted.image());
}

TEST(SmoothEdges, ComesGraduallyOnTheWayFromAPhoto) {
  const Painted painted = Step(12);
  int last = 255;
  // A pixel of displacement at depth 2 and a focal length of 20 px: 0.1 of a unit.
  for (const double away : {0.0, 0.02, 0.05, 0.08, 0.1, 0.5}) {
    const int level = painted.Smoothed(std::vector<Eigen::Vector3d>{{away, 0, 0}})(11, 8, 0);
    EXPECT_LE(level, last) << away;
    EXPECT_LT(last - level, 20) << away;
    last = level;
  }
  EXPECT_EQ(last, Srgb8FromLinear(0.8));
}

TEST(SmoothEdges, DoesNotMixInHolesThatAreNotFilled) {
  Painted painted = Step(10);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 10; x < kWidth; ++x) painted.result.coverage(x, y) = 0;
  }
  EXPECT_EQ(painted.Smoothed(kFarAway, false), painted.image());
  EXPECT_EQ(painted.Smoothed(kFarAway, true)(9, 8, 0), Srgb8FromLinear(0.8));
}

TEST(SmoothEdges, DoesNotDependOnThreadsNorOnTheScaleOfTheWorld) {
  Painted painted = Noise();
  const ImageRgb8 smoothed = painted.Smoothed(kFarAway);
  EXPECT_EQ(painted.Smoothed(kFarAway, true, 3), smoothed);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) painted.result.depth(x, y) *= 1024;
  }
  EXPECT_EQ(painted.Smoothed(std::vector<Eigen::Vector3d>{{5 * 1024, 0, 0}}), smoothed);
}

TEST(SmoothEdges, TakesImagesOfAnySize) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {7, 1}, {2, 2}}) {
    Painted painted(width, height);
    painted.Set(0, 0, 50, 1);
    const ImageRgb8 alone = painted.Smoothed(kFarAway, false);
    EXPECT_EQ(alone, painted.image());
    painted.Smoothed(kFarAway, true);
  }
}

}  // namespace
}  // namespace dtr
