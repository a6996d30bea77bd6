// What is made of the views, within a number of bytes; and frames whose pixels went.
#include <gtest/gtest.h>

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/simd/renderer.h"
#include "tests/simd/many_views.h"

namespace dtr::simd {
namespace {

using namespace dtr::testing;

struct Drawn {
  RenderResult result;
  size_t bytes = 0;
};

Drawn DrawAlone(const RenderScene& scene, double x, const RenderOptions& options) {
  Renderer renderer;
  const Shot novel = CameraAt(x);
  RenderResult result = renderer.Render(scene, novel.camera, novel.cam_from_world, options);
  return {std::move(result), renderer.view_bytes()};
}

TEST(SimdMemory, AnImageDoesNotDependOnTheRoomThatHoldsIt) {
  const DtrSet set = ManyViews();
  const RenderScene scene = MakeRenderScene(set);
  const RenderOptions options = Options(RenderMethod::kDeferred);
  std::vector<RenderResult> expected;
  RendererSettings settings;
  settings.view_bytes = 0;
  for (const double x : kWalk) {
    Drawn drawn = DrawAlone(scene, x, options);
    EXPECT_EQ(drawn.result.views_used.size(), 4u);
    settings.view_bytes = std::max(settings.view_bytes, drawn.bytes);
    expected.push_back(std::move(drawn.result));
  }
  int warnings = 0;
  settings.warn = [&](const std::string&) { ++warnings; };
  Renderer renderer(settings);
  size_t most = 0;
  for (size_t k = 0; k < std::size(kWalk); ++k) {
    const Shot novel = CameraAt(kWalk[k]);
    ExpectSameBytes(expected[k],
                    renderer.Render(scene, novel.camera, novel.cam_from_world, options));
    most = std::max(most, renderer.view_bytes());
  }
  EXPECT_LE(most, settings.view_bytes);
  EXPECT_GT(most, settings.view_bytes / 2);
  EXPECT_EQ(warnings, 0);
}

TEST(SimdMemory, DrawsFromTheNearestThatFitAndSaysSoOnce) {
  const DtrSet set = ManyViews();
  const RenderScene scene = MakeRenderScene(set);
  const RenderOptions options = Options(RenderMethod::kDeferred);
  RenderOptions fewer = options;
  fewer.views = 2;
  RendererSettings settings;
  settings.view_bytes = DrawAlone(scene, 0.1, fewer).bytes;
  std::vector<std::string> warnings;
  settings.warn = [&](const std::string& line) { warnings.push_back(line); };
  Renderer renderer(settings);
  const Shot novel = CameraAt(0.1);
  for (int k = 0; k < 2; ++k) {
    const RenderResult found = renderer.Render(scene, novel.camera, novel.cam_from_world, options);
    ExpectSameBytes(DrawAlone(scene, 0.1, fewer).result, found);
    EXPECT_EQ(found.views_used.size(), 2u);
    EXPECT_LE(renderer.view_bytes(), settings.view_bytes);
  }
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("drawn from the nearest 2 of 4 views"), std::string::npos);
  EXPECT_NE(warnings[0].find("`gpu_memory`"), std::string::npos);
}

TEST(SimdMemory, WhatIsHeldIsDrawnWithoutPixels) {
  DtrSet set = ManyViews();
  std::vector<View>& views = set.frames[0].views;
  const std::vector<View> with_pixels = views;
  const RenderScene scene = MakeRenderScene(set);
  Renderer renderer;
  const Shot novel = CameraAt(0.1);
  const auto draw = [&](const RenderOptions& options) {
    const DrawnImage drawn = renderer.Draw(scene, novel.camera, novel.cam_from_world, options);
    return std::pair(renderer.ReadBack(), drawn);
  };
  const auto can_draw = [&](const RenderOptions& options) {
    return renderer.CanDraw(scene, novel.camera, novel.cam_from_world, options);
  };
  const auto drop = [&](const std::vector<int>& used) {
    for (const int index : used) {
      View& view = views[static_cast<size_t>(index)];
      view.image = {};
      view.depth = {};
    }
  };
  const RenderOptions deferred = Options(RenderMethod::kDeferred);
  const auto [first, drawn] = draw(deferred);
  ASSERT_TRUE(drawn.views_held);
  ASSERT_GT(first.coverage_share, 0.5);
  drop(drawn.views_used);
  EXPECT_TRUE(can_draw(deferred));
  EXPECT_EQ(draw(deferred).first.image, first.image);
  EXPECT_EQ(draw(deferred).first.depth, first.depth);
  // Others need the pixels: other samples, other views, meshes for every pixel.
  RenderOptions coarser = deferred, more = deferred;
  coarser.resolution = 2;
  more.views = 5;
  EXPECT_FALSE(can_draw(coarser));
  EXPECT_FALSE(can_draw(Options(RenderMethod::kTwoPass)));
  EXPECT_TRUE(can_draw(more)) << "the fifth has its pixels";

  views = with_pixels;  // as they are read again: elsewhere in memory
  EXPECT_EQ(draw(deferred).first.image, first.image);
  EXPECT_EQ(draw(coarser).first.image, DrawAlone(scene, 0.1, coarser).result.image);
  drop(drawn.views_used);
  EXPECT_THROW(draw(deferred), Error) << "what it held was of coarser samples";
}

TEST(SimdMemory, NothingIsHeldWhereViewsMakeRoomForOneAnother) {
  const DtrSet set = ManyViews();
  const RenderScene scene = MakeRenderScene(set);
  const RenderOptions deferred = Options(RenderMethod::kDeferred);
  RendererSettings settings;
  settings.view_bytes = DrawAlone(scene, 0.1, deferred).bytes;  // as long as none lies beside them
  Renderer renderer(settings);
  const Shot novel = CameraAt(0.1);
  const DrawnImage drawn = renderer.Draw(scene, novel.camera, novel.cam_from_world, deferred);
  EXPECT_EQ(drawn.views_used.size(), 4u);
  EXPECT_FALSE(drawn.views_held);
}

}  // namespace
}  // namespace dtr::simd
