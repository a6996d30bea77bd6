#include "dtr/simd/renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "dtr/base/error.h"
#include "tests/simd/parity_scenes.h"

namespace dtr::simd {
namespace {

using namespace dtr::testing;

TEST(SimdRenderer, AnImageLeftInMemoryIsTheOneThatRenderGives) {
  const NamedScene scene = ParityScenes()[1];
  const RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  EXPECT_THROW(renderer.ReadBack(), std::logic_error);
  RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  options.fill_holes = options.smooth_edges = true;  // Draw does neither
  const DrawnImage drawn =
      renderer.Draw(views, scene.novel.camera, scene.novel.cam_from_world, options);
  EXPECT_EQ(drawn.width_px, scene.novel.camera.width_px());
  EXPECT_EQ(drawn.height_px, scene.novel.camera.height_px());
  const RenderResult read = renderer.ReadBack();
  for (size_t p = 0; p < read.coverage.data().size(); ++p) {
    const std::uint32_t rgba = drawn.rgba[p];
    ASSERT_EQ(rgba & 255, read.image.data()[3 * p]);
    ASSERT_EQ(rgba >> 24, read.coverage.data()[p]);
    ASSERT_EQ(drawn.depth_z[p], read.depth.grid().data()[p]);
  }
  options.fill_holes = options.smooth_edges = false;
  const RenderResult rendered =
      renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, options);
  ExpectSameBytes(read, rendered);
  EXPECT_EQ(read.views_used, rendered.views_used);
  EXPECT_EQ(drawn.views_used, rendered.views_used);
  EXPECT_GT(read.coverage_share, 0.5);
  EXPECT_THROW(renderer.ReadBack(), std::logic_error);
  renderer.Forget();
  EXPECT_EQ(renderer.view_bytes(), 0u);
  ExpectSameBytes(rendered,
                  renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, options));
}

TEST(SimdRenderer, NoValidViewGivesAnEmptyImage) {
  const NamedScene scene = ParityScenes()[1];
  const RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  RenderOptions nothing_valid = OptionsOf(RenderMethod::kDeferred);
  nothing_valid.max_angle_rad = 1e-9;
  renderer.Draw(views, scene.novel.camera, scene.novel.cam_from_world, nothing_valid);
  EXPECT_EQ(renderer.ReadBack().coverage_share, 0);
  ExpectSound(renderer.ReadBack());
}

TEST(SimdRenderer, WhatCannotBeDrawnIsNamed) {
  const NamedScene scene = ParityScenes().front();
  const RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  const auto render = [&](const RenderOptions& options) {
    return renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, options);
  };
  RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  options.views = 0;
  EXPECT_THROW(render(options), UsageError);
  try {
    render(OptionsOf(RenderMethod::kTwoPass));
    FAIL() << "it was drawn";
  } catch (const UsageError& error) {
    const std::string line = error.what();
    EXPECT_NE(line.find("`method` deferred"), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
  Pose broken = scene.novel.cam_from_world;
  broken.translation.x() = std::nan("");
  EXPECT_THROW(renderer.Render(views, scene.novel.camera, broken, {}), Error);
}

}  // namespace
}  // namespace dtr::simd
