// Depth on the GPU in the set's 16 bits: what the shader decodes is what the file says.
#include "dtr/render/stored_depth.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dtr/gl/layer_sizes.h"
#include "dtr/gl/packed_depth.h"
#include "dtr/types/inverse_depth_code.h"
#include "tests/gl/gl_testing.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;
using StoredPackedDepth = GlTest;

/// As a set on disk gives its depth back.
void RoundToCodes(View& view, double near_z, double far_z) {
  view.depth_coding = DepthCoding::kPng16InverseDepth;
  view.near_z = near_z, view.far_z = far_z;
  const InverseDepthCode code(near_z, far_z);
  for (float& z : view.depth.grid().data()) {
    if (!DepthImage::IsHole(z)) z = code.Decode(code.Encode(z));
  }
}

View RandomDepth(double near_z, double far_z) {
  View view;
  view.camera = PinholeCamera(301, 217, 200, 200, 150, 108);
  view.depth = DepthImage(301, 217);
  Random random(3);
  for (float& z : view.depth.grid().data()) {
    if (random.Uniform(0, 1) < 0.1) continue;
    z = static_cast<float>(1 / random.Uniform(1 / far_z, 1 / near_z));
  }
  view.depth(0, 0) = static_cast<float>(near_z);
  view.depth(1, 0) = static_cast<float>(far_z);
  RoundToCodes(view, near_z, far_z);
  return view;
}

// Four roundings of float: the texel, the offset, the factor and their sum.
constexpr double kRoundings = 4 * 0x1.0p-24;

TEST(StoredDepth, CodesInFewerStepsStayCodes) {
  View view = RandomDepth(2, 90);
  constexpr int kSteps = 300;
  view.depth_coding = DepthCoding::kZstdInverseDepth;
  view.depth_steps = kSteps;
  const InverseDepthCode code(2, 90, kSteps);
  for (float& z : view.depth.grid().data())
    z = code.Decode(DepthImage::IsHole(z) ? 0 : code.Encode(z));
  const SampleGrid samples = MakeSampleGrid(view, 1);
  const StoredDepth stored = StoreDepth(view, samples);
  ASSERT_EQ(stored.codes.size(), samples.inverse_depth.data().size());
  for (size_t i = 0; i < stored.codes.size(); ++i) {
    const double expected = samples.inverse_depth.data()[i];
    ASSERT_LE(stored.codes[i], kSteps + 1);
    ASSERT_EQ(stored.codes[i] == 0, expected == 0);
    if (expected == 0) continue;
    ASSERT_NEAR(stored.offset + stored.factor * stored.codes[i] / UINT16_MAX, expected,
                1e-7 * expected);
  }
}

TEST(StoredDepth, CodesDecodeToTheLoadedDepthWithinFloatRounding) {
  for (const auto& [near_z, far_z] :
       {std::pair(0.5, 1.0), std::pair(2.0, 90.0), std::pair(1e-3, 1e3), std::pair(1e5, 1e9)}) {
    for (const int resolution : {1, 2, 5}) {
      const View view = RandomDepth(near_z, far_z);
      const SampleGrid samples = MakeSampleGrid(view, resolution);
      const StoredDepth stored = StoreDepth(view, samples);
      ASSERT_TRUE(stored.values.empty());
      ASSERT_EQ(stored.codes.size(), samples.inverse_depth.data().size());
      int holes = 0;
      for (size_t i = 0; i < stored.codes.size(); ++i) {
        const double expected = samples.inverse_depth.data()[i];
        ASSERT_EQ(stored.codes[i] == 0, expected == 0);
        if (stored.codes[i] == 0) {
          ++holes;
          continue;
        }
        // own_depth.glsl
        const float texel = static_cast<float>(stored.codes[i]) / 65535.0f;
        const float w =
            static_cast<float>(stored.offset) + static_cast<float>(stored.factor) * texel;
        ASSERT_NEAR(static_cast<double>(w), expected, kRoundings / near_z)
            << near_z << " ... " << far_z << ", code " << stored.codes[i];
      }
      EXPECT_GT(holes, 0);
    }
  }
}

TEST(StoredDepth, WhatCodesCannotHoldStaysFloat) {
  View view = RandomDepth(2, 90);
  const SampleGrid samples = MakeSampleGrid(view, 1);
  View measured = view;
  measured.depth(7, 5) = 3.14159f;  // between two codes
  const StoredDepth stored = StoreDepth(measured, MakeSampleGrid(measured, 1));
  EXPECT_TRUE(stored.codes.empty());
  ASSERT_EQ(stored.values.size(), samples.inverse_depth.data().size());
  EXPECT_FLOAT_EQ(stored.values[5 * 301 + 7], 1 / 3.14159f);
  view.depth_coding = DepthCoding::kExrFloat;
  EXPECT_TRUE(StoreDepth(view, samples).codes.empty());
  view.depth_coding = DepthCoding::kPng16InverseDepth;
  view.near_z = view.far_z = 0;  // a view that never was on disk
  EXPECT_TRUE(StoreDepth(view, samples).codes.empty());
}

TEST(PackedDepth, HasTheEdgeOnceMoreAndThenABitPerBlock) {
  SampleGrid samples;
  samples.inverse_depth = Grid<double>(19, 35);
  samples.masked = Grid<std::uint8_t>(19, 35);
  Grid<double>& w = samples.inverse_depth;
  std::vector<float> values;
  Random random(5);
  for (int y = 0; y < 35; ++y) {
    for (int x = 0; x < 19; ++x) {
      w(x, y) = random.Uniform(0, 1) < 0.1 ? 0 : random.Uniform(1, 1.02);
      const bool masked = x > 14 && y > 20;
      if (masked) w(x, y) = 0, samples.masked(x, y) = 1;
      values.push_back(static_cast<float>(w(x, y)));
    }
  }
  const BreakRule rule{0.01, std::nullopt};
  const std::vector<float> picture = PackedDepth(values, samples, rule);
  const LayerSize size = PackedDepthSize(19, 35);
  ASSERT_EQ(size, (LayerSize{20, 36 + 3}));
  ASSERT_EQ(picture.size(), 20u * 39u);
  const auto at = [&](int x, int y) { return picture[static_cast<size_t>(y * 20 + x)]; };
  int whole = 0;
  for (int y = -1; y < 35; ++y) {
    for (int x = -1; x < 19; ++x) {
      if (x >= 0 && y >= 0) {
        EXPECT_EQ(at(x, y), static_cast<float>(w(x, y)));
      }
      const auto bits = static_cast<unsigned>(at(x + 1, 36 + (y + 1) / 16));
      const bool masked = x > 14 && y > 20;
      EXPECT_EQ(bits >> ((y + 1) % 16) & 1, masked || IsWholeBlock(w, x, y, rule) ? 1u : 0u)
          << x << " " << y;
      whole += IsWholeBlock(w, x, y, rule);
    }
  }
  EXPECT_GT(whole, 50);
  EXPECT_LT(whole, 650);
  EXPECT_EQ(at(19, 7), at(18, 7));
  EXPECT_EQ(at(3, 35), at(3, 34));
  EXPECT_EQ(at(19, 35), at(18, 34));
}

TEST_F(StoredPackedDepth, IsThatOfFloatDepth) {
  NamedScene scene = ParityScenes()[3];  // holes and masks
  for (View& view : scene.set.frames[0].views) RoundToCodes(view, 3, 30);
  RenderOptions options;
  options.method = RenderMethod::kDeferred;
  const auto render = [&] {
    Renderer renderer;
    return renderer.Render(MakeRenderScene(scene.set), scene.novel.camera,
                           scene.novel.cam_from_world, options);
  };
  const RenderResult coded = render();
  for (View& view : scene.set.frames[0].views) view.depth_coding = DepthCoding::kExrFloat;
  const RenderResult plain = render();
  EXPECT_GT(coded.coverage_share, 0.5);
  long long apart = 0;
  for (int y = 0; y < coded.image.height(); ++y) {
    for (int x = 0; x < coded.image.width(); ++x) {
      apart += PixelDifference(coded.image, plain.image, x, y) > 1 ||
               coded.coverage(x, y) != plain.coverage(x, y);
    }
  }
  // Rounding may turn a fragment at a threshold: a pixel in a thousand.
  EXPECT_LE(apart, static_cast<long long>(coded.coverage.data().size() / 1000));
}

}  // namespace
}  // namespace dtr::gl
