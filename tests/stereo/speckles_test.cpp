#include "stereo/patchmatch/speckles.h"

#include <gtest/gtest.h>

#include "dtr/base/random.h"

namespace dtr::stereo::patchmatch {
namespace {

constexpr int kWidth = 200, kHeight = 150;  // speckles have fewer than 3 pixels
constexpr float kPxPerW = 100, kRange = 1;  // w from 0.2 to 1.2: a hundred pixels of disparity

struct GreyImage {
  DepthEstimate estimate{DepthImage(kWidth, kHeight), Grid<float>(kWidth, kHeight)};
  Grid<float> px_per_w = Grid<float>(kWidth, kHeight, 1, kPxPerW);
  Grid<std::uint8_t> consistent = Grid<std::uint8_t>(kWidth, kHeight, 1, 2);

  void Set(int x, int y, double w) {
    estimate.depth(x, y) = static_cast<float>(1 / w);
    estimate.inverse_depth_sigma(x, y) = 0.01f;
  }
  /// Share of the depths there are now that are left.
  double Left() {
    const auto count = [&] {
      long depths = 0;
      for (const float z : estimate.depth.grid().data()) depths += z > 0;
      return static_cast<double>(depths);
    };
    const double before = count();
    RemoveSpeckles({px_per_w, consistent, 1, kRange}, &estimate);
    for (size_t p = 0; p < px_per_w.data().size(); ++p) {
      EXPECT_EQ(estimate.depth.grid().data()[p] > 0, estimate.inverse_depth_sigma.data()[p] > 0);
    }
    return count() / before;
  }
};

TEST(Speckles, SurfacesStay) {
  GreyImage picture;
  for (int y = 20; y < 80; ++y) {
    for (int x = 20; x < 120; ++x) picture.Set(x, y, 0.3 + 0.002 * x);
  }
  EXPECT_EQ(picture.Left(), 1);
}

TEST(Speckles, WhatFewViewsLeadToGoes) {
  GreyImage picture;
  for (int y = 10; y < 140; y += 3) {
    for (int x = 10; x < 190; x += 3) picture.Set(x, y, 0.5);
  }
  picture.consistent = Grid<std::uint8_t>(kWidth, kHeight, 1, 1);
  EXPECT_EQ(picture.Left(), 0);
}

// Leaves, wire netting: nothing is connected, all of it lies at much the same depth.
TEST(Speckles, ThinThingsKeepEachOther) {
  GreyImage picture;
  Random random(1);
  for (int y = 10; y < 140; y += 3) {
    for (int x = 10; x < 190; x += 3) picture.Set(x, y, 0.5 + 0.01 * random.Normal());
  }
  EXPECT_GT(picture.Left(), 0.95);
}

TEST(Speckles, OneAloneStays) {
  GreyImage picture;
  picture.Set(50, 50, 0.5);
  EXPECT_EQ(picture.Left(), 1);
}

// Ground that repeats: chance gives each of them two views, and any depth.
TEST(Speckles, ChanceIsTakenOut) {
  GreyImage picture;
  Random random(2);
  for (int y = 10; y < 140; y += 3) {
    for (int x = 10; x < 190; x += 3) picture.Set(x, y, random.Uniform(0.2, 1.2));
  }
  EXPECT_LT(picture.Left(), 0.01);
}

TEST(Speckles, ThinThingsBeforeAWallStay) {
  GreyImage picture;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) picture.Set(x, y, (x + y) % 7 == 0 ? 0.9 : 0.4);
  }
  EXPECT_EQ(picture.Left(), 1);
}

}  // namespace
}  // namespace dtr::stereo::patchmatch
