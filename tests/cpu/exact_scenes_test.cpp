#include "tests/cpu/exact_scenes.h"

#include <gtest/gtest.h>

namespace dtr {
namespace {

// A sixteenth of the full pixels: rods are thinner than a pixel and the same texture is coarser.
TEST(ExactScenes, SmallCourtyardIsRenderedFromTheOtherViews) {
  const auto figures = testing::MeasureExactScene("courtyard", 16, 240, 160, 2);
  EXPECT_GT(figures.psnr_covered_db, 26);
  EXPECT_GT(figures.visible_coverage, 0.95);
}

}  // namespace
}  // namespace dtr
