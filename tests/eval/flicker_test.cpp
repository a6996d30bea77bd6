#include "dtr/eval/flicker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace dtr::eval {
namespace {

DepthImage Depth(float left, float right) {
  DepthImage depth(2, 1);
  depth(0, 0) = left;
  depth(1, 0) = right;
  return depth;
}

TEST(Flicker, IsTheDeviationOverTimeWhereTruthStands) {
  ViewFlicker view;
  // The left pixel stands still at 10, found at 9 and 11; the right one moves and does not count.
  view.Add(Depth(9, 4), Depth(10, 4), {});
  view.Add(Depth(11, 5), Depth(10, 5), {});
  const FlickerScores scores = FlickerOf({view});
  EXPECT_EQ(scores.still_pixels, 1);
  EXPECT_EQ(scores.pixels, 1);
  ASSERT_TRUE(scores.mean_relative_deviation);
  EXPECT_NEAR(*scores.mean_relative_deviation, 0.1, 1e-12);
  EXPECT_NEAR(*scores.median_relative_deviation, 0.1, 1e-12);
  EXPECT_EQ(scores.come_and_go_share, 0);
}

TEST(Flicker, PixelsThatAreMostlyHolesHaveNoDeviationButComeAndGo) {
  ViewFlicker view;
  for (int step = 0; step < 5; ++step) {
    view.Add(Depth(step % 2 == 1 ? 0.0f : 3.0f, step == 2 ? 3.0f : 0.0f), Depth(3, 3), {});
  }
  const FlickerScores scores = FlickerOf({view});
  EXPECT_EQ(scores.still_pixels, 2);
  EXPECT_EQ(scores.pixels, 1);  // 3 of 5 time steps; the other has 1
  EXPECT_NEAR(*scores.mean_relative_deviation, 0, 1e-12);
  EXPECT_NEAR(*scores.come_and_go_share, (4 + 2) / 8.0, 1e-12);
}

TEST(Flicker, WhatAMaskLeavesOutOnceDoesNotCount) {
  ViewFlicker view;
  Mask none(2, 1);
  view.Add(Depth(3, 3), Depth(3, 3), {});
  view.Add(Depth(3, 3), Depth(3, 3), none);
  const FlickerScores scores = FlickerOf({view});
  EXPECT_EQ(scores.still_pixels, 0);
  EXPECT_FALSE(scores.mean_relative_deviation);
}

TEST(Flicker, RejectsOtherSizes) {
  ViewFlicker view;
  view.Add(Depth(3, 3), Depth(3, 3), {});
  EXPECT_THROW(view.Add(DepthImage(3, 1), DepthImage(3, 1), {}), std::invalid_argument);
}

}  // namespace
}  // namespace dtr::eval
