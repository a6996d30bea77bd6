#include "dtr/render/hole_planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/random.h"

namespace dtr {
namespace {

constexpr int kColumns = 120, kRows = 80, kHorizon = 40;
constexpr double kTolerance = 0.005;
const ImagePlane kWall(0, 0, 0.1), kGround(0, 0.01, 0.1 - 0.01 * kHorizon);

/// A wall, ground before it, a fifth of strays and a corner of which nothing is known.
Grid<double> WallAndGround() {
  Grid<double> w(kColumns, kRows);
  Random random(4);
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      if (x > 100 && y > 60) continue;
      const ImagePlane& plane = y < kHorizon ? kWall : kGround;
      const bool stray = random.Index(5) == 0;
      w(x, y) = stray ? random.Uniform(0.01, 1)
                      : plane.dot(ImagePlane(x + 0.5, y + 0.5, 1)) + random.Uniform(-1e-3, 1e-3);
    }
  }
  return w;
}

double LargestDistance(const ImagePlane& a, const ImagePlane& b) {
  double largest = 0;
  for (const double x : {0, kColumns}) {
    for (const double y : {0, kRows}) {
      largest = std::max(largest, std::abs((a - b).dot(ImagePlane(x, y, 1))));
    }
  }
  return largest;
}

TEST(FindPlanes, FindsThemAmongStraysTheLargestFirst) {
  const std::vector<ImagePlane> planes = FindPlanes(WallAndGround(), kTolerance);
  ASSERT_GE(planes.size(), 2u);
  EXPECT_LT(LargestDistance(planes[0], kWall), kTolerance);
  EXPECT_LT(LargestDistance(planes[1], kGround), kTolerance);
  EXPECT_EQ(FindPlanes(WallAndGround(), kTolerance), planes);
}

TEST(FindPlanes, ThereIsNoneInNoiseOrWhereNothingIsKnown) {
  EXPECT_TRUE(FindPlanes({}, kTolerance).empty());
  EXPECT_TRUE(FindPlanes(Grid<double>(50, 40), kTolerance).empty());
  Grid<double> one(50, 40);
  one(3, 3) = 1;
  EXPECT_TRUE(FindPlanes(one, kTolerance).empty());
  Grid<double> noise(kColumns, kRows);
  Random random(5);
  for (double& w : noise.data()) w = random.Uniform(0.01, 1);
  EXPECT_TRUE(FindPlanes(noise, 1e-3).empty());
}

}  // namespace
}  // namespace dtr
