// tests/cpu/render_testing.h -- sets and comparisons of the reference renderer's tests.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "dtr/render/geometry.h"
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "tests/support/analytic_scene.h"

namespace dtr::testing {

inline constexpr BlendWeight kAllWeights[] = {BlendWeight::kCosine, BlendWeight::kExponential,
                                              BlendWeight::kAngle, BlendWeight::kInverseAngle,
                                              BlendWeight::kKNearest};

inline constexpr RenderMethod kBothMethods[] = {RenderMethod::kTwoPass, RenderMethod::kDeferred};

inline RenderOptions OptionsOf(RenderMethod method) {
  RenderOptions options;
  options.method = method;
  return options;
}

inline DtrSet SetOf(std::vector<View> views) {
  DtrSet set;
  set.frames.resize(1);
  set.frames[0].views = std::move(views);
  FinishGeometry(set);
  return set;
}

inline Shot ShotFrom(const std::string& id, const Eigen::Vector3d& center,
                     const Eigen::Vector3d& target) {
  Shot shot;
  shot.id = id;
  shot.cam_from_world = LookAt(center, target);
  return shot;
}

/// A square of side 2 at z = 5 before the plane z = 10.
inline Surface SquareAndPlane() { return Union(Square(0, 0, 5, 1), Plane({0, 0, 1}, 10)); }

/// Five views of it, 0.5 apart on a line.
inline DtrSet SquareBeforePlane() {
  std::vector<View> views;
  for (int i = 0; i < 5; ++i) {
    views.push_back(Photograph(
        SquareAndPlane(), ShotFrom("v" + std::to_string(i), {0.5 * (i - 2), 0, 0}, {0, 0, 10})));
  }
  return SetOf(std::move(views));
}

inline int PixelDifference(const ImageRgb8& a, const ImageRgb8& b, int x, int y) {
  int largest = 0;
  for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a(x, y, c) - b(x, y, c)));
  return largest;
}

inline int LargestDifference(const ImageRgb8& a, const ImageRgb8& b) {
  int largest = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) largest = std::max(largest, PixelDifference(a, b, x, y));
  }
  return largest;
}

inline void ExpectSameBytes(const RenderResult& a, const RenderResult& b) {
  EXPECT_EQ(a.image.data(), b.image.data());
  EXPECT_EQ(a.depth.grid().data(), b.depth.grid().data());
  EXPECT_EQ(a.coverage.data(), b.coverage.data());
  EXPECT_EQ(a.view_count.data(), b.view_count.data());
  EXPECT_EQ(a.delta_border.data(), b.delta_border.data());
}

/// Every field of a result agrees with the others, and nothing is NaN or infinite.
inline void ExpectSound(const RenderResult& result) {
  for (size_t p = 0; p < result.coverage.data().size(); ++p) {
    const float depth = result.depth.grid().data()[p];
    ASSERT_TRUE(std::isfinite(depth) && depth >= 0);
    const bool seen = result.coverage.data()[p] != 0;
    ASSERT_EQ(seen, depth > 0);
    ASSERT_EQ(seen, result.view_count.data()[p] > 0);
    if (!seen) {
      for (size_t c = 0; c < 3; ++c) ASSERT_EQ(result.image.data()[3 * p + c], 0);
    }
  }
}

}  // namespace dtr::testing
