// Smaller views, by hand and against exact planes.
#include "dtr/prune/coding.h"

#include <gtest/gtest.h>

#include <cmath>

#include "datasets/exact/analytic_scene.h"
#include "dtr/render/scene.h"

namespace dtr::prune {
namespace {

DepthImage FourSamples(float a, float b, float c, float d) {
  DepthImage depth(2, 2);
  depth(0, 0) = a, depth(1, 0) = b, depth(0, 1) = c, depth(1, 1) = d;
  return depth;
}

TEST(ShrunkDepth, TakesTheSurfaceOfMostSamplesAndTheNearerOfTwo) {
  constexpr double kBreak = 0.1;
  // Mean of 1/2, 1/2, 1/2.1 within the break; the sample at 10 is another surface.
  const double mean = (1 / 2.0 + 1 / 2.0 + 1 / 2.1) / 3;
  EXPECT_FLOAT_EQ(ShrunkDepth(FourSamples(2, 2.1f, 10, 2), 2, kBreak)(0, 0),
                  static_cast<float>(1 / mean));
  EXPECT_FLOAT_EQ(ShrunkDepth(FourSamples(2, 2, 10, 10), 2, kBreak)(0, 0), 2);
  EXPECT_FLOAT_EQ(ShrunkDepth(FourSamples(10, 10, 10, 2), 2, kBreak)(0, 0), 10);
  EXPECT_FLOAT_EQ(ShrunkDepth(FourSamples(0, 4, 4, 0), 2, kBreak)(0, 0), 4);
  EXPECT_EQ(ShrunkDepth(FourSamples(0, 4, 0, 0), 2, kBreak)(0, 0), 0) << "less than half";
}

TEST(ShrunkView, HasTheExactDepthOfAPlaneOnItsOwnGrid) {
  // Across 2x2 samples of this plane 1/z is linear, so their mean is that of the middle.
  const auto plane = testing::Plane(Eigen::Vector3d(0.2, -0.3, -1).normalized(), -5);
  View view = testing::Photograph(plane, {"a", PinholeCamera(96, 72, 100, 90, 47, 37), {}, 1, 4});
  view.reference_baseline = 0.2;
  view.mesh.emplace();
  const View small = ShrunkView(view, 2);
  EXPECT_EQ(small.camera.width_px(), 48);
  EXPECT_EQ(small.image.height(), 36);
  EXPECT_FALSE(small.mesh);
  const View exact = testing::Photograph(plane, {"a", small.camera, {}, 1, 4});
  constexpr double kRelative = 1e-6;  // float32 depths, a few roundings
  for (size_t i = 0; i < exact.depth.grid().data().size(); ++i) {
    const double z = exact.depth.grid().data()[i];
    ASSERT_GT(z, 0);
    ASSERT_NEAR(small.depth.grid().data()[i], z, kRelative * z);
  }
}

TEST(CanShrink, NeedsSizesThatDivide) {
  DtrSet set;
  set.frames.resize(1);
  View view;
  view.camera = PinholeCamera(96, 72, 100, 100, 48, 36);
  set.frames[0].views = {view};
  EXPECT_TRUE(CanShrink(set, 2));
  EXPECT_FALSE(CanShrink(set, 5));
  set.frames[0].views[0].depth_scale = 4;
  EXPECT_TRUE(CanShrink(set, 2));
  EXPECT_FALSE(CanShrink(set, 4)) << "18 rows of depth do not divide by 4";
  set.frames[0].views[0].role = ViewRole::kHeldOut;
  EXPECT_TRUE(CanShrink(set, 4)) << "held-out photos keep their size";
}

}  // namespace
}  // namespace dtr::prune
