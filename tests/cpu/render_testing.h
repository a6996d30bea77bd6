// tests/cpu/render_testing.h -- sets and comparisons of the reference renderer's tests.
#pragma once
#include <gtest/gtest.h>

#include "datasets/exact/render_scenes.h"

namespace dtr::testing {

inline void ExpectSameBytes(const RenderResult& a, const RenderResult& b) {
  EXPECT_EQ(a.image.data(), b.image.data());
  EXPECT_EQ(a.depth.grid().data(), b.depth.grid().data());
  EXPECT_EQ(a.coverage.data(), b.coverage.data());
  EXPECT_EQ(a.view_count.data(), b.view_count.data());
  EXPECT_EQ(a.delta_border.data(), b.delta_border.data());
}

/// Every field of a result agrees with the others, and nothing is NaN or infinite.
inline void ExpectSound(const RenderResult& result) { ASSERT_EQ(Contradictions(result), 0); }

}  // namespace dtr::testing
