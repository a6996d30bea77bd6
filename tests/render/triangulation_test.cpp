#include "dtr/render/triangulation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dtr {
namespace {

Grid<double> Row(const std::vector<double>& values) {
  Grid<double> grid(static_cast<int>(values.size()), 2);
  for (size_t i = 0; i < values.size(); ++i) {
    grid(static_cast<int>(i), 0) = grid(static_cast<int>(i), 1) = values[i];
  }
  return grid;
}

bool Breaks(const std::vector<double>& values, int x, double threshold) {
  return EdgeBreaks(Row(values), x, 0, 1, 0, BreakRule{threshold, std::nullopt});
}

TEST(EdgeBreaks, ASlantedPlaneDoesNotBreakHoweverSteep) {
  std::vector<double> plane;
  for (int i = 0; i < 8; ++i) plane.push_back(10 + 5.0 * i);
  for (int x = 0; x + 1 < 8; ++x) EXPECT_FALSE(Breaks(plane, x, 1)) << x;
}

TEST(EdgeBreaks, AStepBreaksAndItsSidesDoNot) {
  const std::vector<double> step = {10, 10, 10, 20, 20, 20};
  EXPECT_TRUE(Breaks(step, 2, 1));
  EXPECT_FALSE(Breaks(step, 1, 1));
  EXPECT_FALSE(Breaks(step, 3, 1));
  EXPECT_FALSE(Breaks(step, 2, 10));  // as large as the threshold
  EXPECT_TRUE(Breaks(step, 2, 9.999));
}

TEST(EdgeBreaks, AStepOnASlantedSurfaceBreaks) {
  const std::vector<double> step = {10, 15, 20, 45, 50, 55};
  EXPECT_TRUE(Breaks(step, 2, 1));
  EXPECT_FALSE(Breaks(step, 1, 6));
}

TEST(EdgeBreaks, ACreaseBetweenTwoSteepSurfacesHolds) {
  const std::vector<double> roof = {10, 15, 20, 25, 20, 15, 10};
  for (int x = 0; x + 1 < 7; ++x) EXPECT_FALSE(Breaks(roof, x, 1)) << x;
}

TEST(EdgeBreaks, OneMixedPixelDoesNotBridgeAStep) {
  const std::vector<double> mixed = {10, 10, 10, 15, 20, 20, 20};
  EXPECT_TRUE(Breaks(mixed, 2, 1));
  EXPECT_TRUE(Breaks(mixed, 3, 1));
}

TEST(EdgeBreaks, AThinRodBreaksOnBothSides) {
  const std::vector<double> rod = {10, 10, 20, 10, 10};
  EXPECT_TRUE(Breaks(rod, 1, 1));
  EXPECT_TRUE(Breaks(rod, 2, 1));
}

TEST(EdgeBreaks, TheReportsRuleComparesDepth) {
  const Grid<double> grid = Row({1 / 10.0, 1 / 13.0});
  EXPECT_FALSE(EdgeBreaks(grid, 0, 0, 1, 0, BreakRule{0, 3.5}));
  EXPECT_TRUE(EdgeBreaks(grid, 0, 0, 1, 0, BreakRule{1, 2.5}));
}

TEST(TrianglesOfBlock, SplitsAlongTheFlatterDiagonal) {
  Grid<double> block(2, 2, 1, 1.0);
  const BreakRule rule{100, std::nullopt};
  EXPECT_EQ(TrianglesOfBlock(block, 0, 0, rule).corners[0], kA | kB | kD);  // a tie
  EXPECT_EQ(TrianglesOfBlock(block, 0, 0, rule).corners[1], kA | kD | kC);
  block(0, 0) = 2;  // A stands out: B-C is flatter
  EXPECT_EQ(TrianglesOfBlock(block, 0, 0, rule).corners[0], kA | kB | kC);
  EXPECT_EQ(TrianglesOfBlock(block, 0, 0, rule).corners[1], kB | kD | kC);
}

TEST(TrianglesOfBlock, AHoleLeavesTheTriangleOfTheOtherThree) {
  const BreakRule rule{1, std::nullopt};
  const int expected[4] = {kB | kC | kD, kA | kC | kD, kA | kB | kD, kA | kB | kC};
  for (int hole = 0; hole < 4; ++hole) {
    Grid<double> block(2, 2, 1, 1.0);
    block(hole & 1, hole >> 1) = 0;
    const BlockTriangles triangles = TrianglesOfBlock(block, 0, 0, rule);
    EXPECT_EQ(triangles.corners[0] | triangles.corners[1], expected[hole]) << hole;
    EXPECT_EQ(triangles.corners[0] & triangles.corners[1], 0) << hole;
    block((hole + 1) & 1, hole >> 1) = 0;
    const BlockTriangles two = TrianglesOfBlock(block, 0, 0, rule);
    EXPECT_EQ(two.corners[0] | two.corners[1], 0);
  }
}

TEST(TrianglesOfBlock, ACornerAcrossAStepIsCutOff) {
  Grid<double> grid(4, 4, 1, 10.0);
  grid(2, 2) = grid(3, 2) = grid(2, 3) = grid(3, 3) = 30;
  const BlockTriangles triangles = TrianglesOfBlock(grid, 1, 1, BreakRule{1, std::nullopt});
  EXPECT_EQ(triangles.corners[0], kA | kB | kC);
  EXPECT_EQ(triangles.corners[1], 0);
}

TEST(IsWholeBlock, WhereBothTrianglesAreDrawnAndAlongTheBorder) {
  // Straight and steep along x, a step of 30 before row 4, a hole in the last column.
  Grid<double> grid(6, 6);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 6; ++x) grid(x, y) = 10 + 5 * x + (y < 4 ? 0 : 30);
  }
  grid(5, 1) = 0;
  const BreakRule rule{1, std::nullopt};
  EXPECT_TRUE(IsWholeBlock(grid, 0, 0, rule));
  EXPECT_TRUE(IsWholeBlock(grid, 2, 2, rule));
  EXPECT_FALSE(IsWholeBlock(grid, 2, 3, rule));  // across the step
  EXPECT_FALSE(IsWholeBlock(grid, 4, 0, rule));  // the hole
  EXPECT_FALSE(IsWholeBlock(grid, 4, 1, rule));
  EXPECT_TRUE(IsWholeBlock(grid, 0, 0, BreakRule{0, 0.04}));
  EXPECT_FALSE(IsWholeBlock(grid, 0, 0, BreakRule{0, 0.03}));  // 1/10 - 1/15
  // Around the grid: edges and single samples.
  EXPECT_TRUE(IsWholeBlock(grid, -1, 2, rule));
  EXPECT_FALSE(IsWholeBlock(grid, -1, 3, rule));
  EXPECT_TRUE(IsWholeBlock(grid, 1, -1, rule));
  EXPECT_FALSE(IsWholeBlock(grid, 5, 0, rule));
  EXPECT_TRUE(IsWholeBlock(grid, 5, 5, rule));
  EXPECT_TRUE(IsWholeBlock(grid, -1, -1, rule));
  grid(0, 0) = 0;
  EXPECT_FALSE(IsWholeBlock(grid, -1, -1, rule));
}

TEST(MakeSampleGrid, TakesTheMiddleOfEveryRPixels) {
  View view;
  view.camera = PinholeCamera(7, 5, 10, 10, 3.5, 2.5);
  view.depth = DepthImage(7, 5);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 7; ++x) view.depth(x, y) = static_cast<float>(1 + x + 10 * y);
  }
  view.depth(4, 1) = std::nanf("");
  const SampleGrid samples = MakeSampleGrid(view, 3);
  ASSERT_EQ(samples.inverse_depth.width(), 2);   // pixels 1 and 4
  ASSERT_EQ(samples.inverse_depth.height(), 2);  // rows 1 and 4
  EXPECT_EQ(samples.inverse_depth(0, 0), 1.0 / 12);
  EXPECT_EQ(samples.inverse_depth(1, 0), 0);
  EXPECT_EQ(samples.inverse_depth(1, 1), 1.0 / 45);
  EXPECT_EQ(samples.Centre(1), 4.5);
  EXPECT_TRUE(MakeSampleGrid(view, 100).inverse_depth.empty());
}

}  // namespace
}  // namespace dtr
