// The vector renderer against the reference: the measure of comparison.h on exact scenes, on one
// that is damaged as real captures are, and on simple shapes with masks, gains and few samples.
#include <gtest/gtest.h>

#include <algorithm>

#include "dtr/cpu/renderer.h"
#include "dtr/simd/renderer.h"
#include "tests/simd/comparison.h"
#include "tests/simd/parity_matrix.h"
#include "tests/support/instruction_sets.h"

namespace dtr::simd {
namespace {

using namespace dtr::testing;

class ExactSceneSimdParity : public ::testing::TestWithParam<std::string> {};

TEST_P(ExactSceneSimdParity, HoldsForEveryWeightAndResolution) {
  Renderer renderer;
  ExpectParityOfDeferred(renderer, ExactOrDamagedScene(GetParam(), 5, 192, 128), 4);
}

INSTANTIATE_TEST_SUITE_P(, ExactSceneSimdParity, ::testing::ValuesIn(ExactSceneNames()),
                         [](const auto& test) { return test.param; });

class ShapeSimdParity : public ::testing::TestWithParam<int> {};

TEST_P(ShapeSimdParity, HoldsForEveryWeightAndResolution) {
  Renderer renderer;
  ExpectParityOfDeferred(renderer, ParityScenes()[static_cast<size_t>(GetParam())], 4);
}

INSTANTIATE_TEST_SUITE_P(, ShapeSimdParity, ::testing::Range(0, 6));

// The kernel is chosen by the processor; every choice draws the reference.
TEST(SimdParity, HoldsWithEveryInstructionSet) {
  const std::vector<NamedScene> scenes = ParityScenes();
  WithEachInstructionSet([&](auto) {
    Renderer renderer;
    for (const size_t k : {3u, 5u}) {  // the second by the per-pixel rule
      ExpectParityOf(renderer, scenes[k], RenderMethod::kDeferred, Primitive::kMesh, 4);
    }
  });
}

TEST(SimdParity, HoldsForTheReportsAbsoluteThresholdsAndInLinearLight) {
  Renderer renderer;
  for (const NamedScene& scene : ParityScenes()) {
    RenderOptions options = OptionsOf(RenderMethod::kDeferred);
    options.absolute_delta = 0.4;
    options.absolute_depth_break = 1.5;
    EXPECT_TRUE(ExpectParity(renderer, scene, options).Holds()) << scene.name;
    options = OptionsOf(RenderMethod::kDeferred);
    options.blend_in_linear_light = true;
    options.delta_px = 3;
    EXPECT_TRUE(ExpectParity(renderer, scene, options).Holds()) << scene.name;
  }
}

TEST(SimdParity, HoldsForExponentsWhoseWeightsFitNoFloat) {
  Renderer renderer;
  const NamedScene scene = ParityScenes()[1];
  for (const int power : {1, 10, 16, 20, 60}) {
    RenderOptions options = OptionsOf(RenderMethod::kDeferred);
    options.blend_k = power;
    EXPECT_TRUE(ExpectParity(renderer, scene, options).Holds()) << power;
  }
}

TEST(SimdParity, HoldsForMoreViewsThanAnyPixelSees) {
  Renderer renderer;
  const NamedScene scene{"80 views", FromAround(Plane({0.4, 0.1, 0.9}, 8), 80, 0.8, {0, 0, 9}),
                         ShotFrom("n", {0, 0, 0}, {0, 0, 9})};
  RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  options.views = 80;
  EXPECT_TRUE(ExpectParity(renderer, scene, options).Holds());
}

TEST(SimdParity, HoldsWhereViewsAreMaskedInLargePieces) {
  const NamedScene scene = MaskedInLargePieces();
  Renderer renderer;
  for (const int resolution : {1, 2}) {
    RenderOptions options = OptionsOf(RenderMethod::kDeferred);
    options.resolution = resolution;
    EXPECT_TRUE(ExpectParity(renderer, scene, options).Holds()) << resolution;
  }
}

TEST(SimdParity, HoldsWhereAViewHasNoDepthAtAll) {
  const NamedScene scene = OneViewWithoutDepth();
  Renderer renderer;
  const RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  EXPECT_TRUE(ExpectParity(renderer, scene, options).Holds());
  const RenderResult image = cpu::Render(MakeRenderScene(scene.set), scene.novel.camera,
                                         scene.novel.cam_from_world, options);
  const auto& coverage = image.coverage.data();
  EXPECT_GT(std::count_if(coverage.begin(), coverage.end(), [](auto c) { return c != 0; }),
            static_cast<std::ptrdiff_t>(coverage.size() / 2));
}

}  // namespace
}  // namespace dtr::simd
