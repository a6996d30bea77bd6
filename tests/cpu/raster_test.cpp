#include "dtr/cpu/raster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "dtr/base/random.h"

namespace dtr::cpu {
namespace {

constexpr Band kBand{24, 0, 20};

std::vector<int> CoveredBy(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c) {
  Layer layer(kBand);
  DrawTriangle(a, b, c, layer);
  std::vector<int> covered;
  for (const double w : layer.inverse_depth) covered.push_back(w > 0);
  return covered;
}

TEST(DrawTriangle, AJitteredMeshCoversEveryPixelExactlyOnce) {
  constexpr int kMeshes = 200;
  Random random(11);
  for (int mesh = 0; mesh < kMeshes; ++mesh) {
    // A 6x5 grid of cells, too little bent to fold, over the whole band; some coordinates fall
    // exactly on pixel centres.
    ScreenVertex vertex[6][7];
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 7; ++i) {
        const bool rim = i == 0 || j == 0 || i == 6 || j == 5;
        const double jitter_x = rim ? 0 : random.Uniform(-0.4, 0.4);
        const double jitter_y = rim ? 0 : random.Uniform(-0.4, 0.4);
        double x = i * 4 + jitter_x, y = j * 4 + jitter_y;
        if (!rim && random.Index(3) == 0) x = std::floor(x) + 0.5, y = std::floor(y) + 0.5;
        vertex[j][i] = {SnapToSubpixel(x), SnapToSubpixel(y), 1};
      }
    }
    std::vector<int> count(24 * 20, 0);
    const auto add = [&](const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c) {
      const std::vector<int> covered = CoveredBy(a, b, c);
      for (size_t p = 0; p < count.size(); ++p) count[p] += covered[p];
    };
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 6; ++i) {
        add(vertex[j][i], vertex[j][i + 1], vertex[j + 1][i + 1]);
        add(vertex[j][i], vertex[j + 1][i + 1], vertex[j + 1][i]);
      }
    }
    for (size_t p = 0; p < count.size(); ++p) ASSERT_EQ(count[p], 1) << mesh << " pixel " << p;
  }
}

TEST(DrawTriangle, InverseDepthIsLinearOnTheScreen) {
  Layer layer(kBand);
  const auto w = [](double x, double y) { return 1 + 0.01 * x + 0.02 * y; };
  const auto at = [&](double x, double y) { return ScreenVertex{x, y, w(x, y)}; };
  DrawTriangle(at(-10, -10), at(60, -10), at(-10, 60), layer);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 24; ++x) {
      ASSERT_NEAR(layer.inverse_depth[static_cast<size_t>(y * 24 + x)], w(x + 0.5, y + 0.5), 1e-14);
    }
  }
}

TEST(DrawTriangle, TheNearestWinsInAnyOrder) {
  for (const bool near_first : {true, false}) {
    Layer layer(kBand);
    for (const double w : near_first ? std::vector{2.0, 1.0} : std::vector{1.0, 2.0}) {
      DrawTriangle({0, 0, w}, {24, 0, w}, {0, 20, w}, layer);
    }
    EXPECT_EQ(layer.inverse_depth[0], 2);
  }
}

TEST(DrawTriangle, BacksFlatAndFarAwayTrianglesDrawNothing) {
  const ScreenVertex a{0, 0, 1}, b{20, 0, 1}, c{0, 20, 1};
  const auto none = [](const std::vector<int>& covered) {
    return std::count(covered.begin(), covered.end(), 1) == 0;
  };
  EXPECT_FALSE(none(CoveredBy(a, b, c)));
  EXPECT_TRUE(none(CoveredBy(a, c, b)));
  EXPECT_TRUE(none(CoveredBy(a, b, b)));
  EXPECT_TRUE(none(CoveredBy({1e300, 0, 1}, {1e301, 0, 1}, {1e300, 1e301, 1})));
  EXPECT_TRUE(none(CoveredBy({-1e12, -1e12, 1}, {-1e11, -1e12, 1}, {-1e12, -1e11, 1})));
}

TEST(DrawTriangle, ABandShowsItsRowsOnly) {
  Layer whole(kBand), part(Band{24, 7, 5});
  const ScreenVertex a{1, 1, 1}, b{22.5, 3, 2}, c{4, 19, 3};
  DrawTriangle(a, b, c, whole);
  DrawTriangle(a, b, c, part);
  for (int y = 7; y < 12; ++y) {
    for (int x = 0; x < 24; ++x) {
      ASSERT_EQ(part.inverse_depth[static_cast<size_t>((y - 7) * 24 + x)],
                whole.inverse_depth[static_cast<size_t>(y * 24 + x)]);
    }
  }
}

TEST(DrawSquare, IsHalfOpen) {
  Layer layer(kBand);
  DrawSquare({5, 5, 1}, 1.5, layer);  // centres 3.5 ... 5.5; 6.5 is outside
  double sum = 0;
  for (const double w : layer.inverse_depth) sum += w;
  EXPECT_EQ(sum, 9);
  EXPECT_EQ(layer.inverse_depth[3 * 24 + 3], 1);
  EXPECT_EQ(layer.inverse_depth[6 * 24 + 6], 0);
}

}  // namespace
}  // namespace dtr::cpu
