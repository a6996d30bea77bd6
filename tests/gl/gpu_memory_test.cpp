// Sets larger than the GPU's memory: what is drawn within a number of bytes, and what is said.
#include <gtest/gtest.h>

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/gl/drawing.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/texture_arrays.h"
#include "tests/gl/gl_testing.h"
#include "tests/simd/many_views.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;
using GpuMemory = GlTest;

std::vector<RenderOptions> EveryWay() {
  return {Options(RenderMethod::kTwoPass), Options(RenderMethod::kTwoPass, Primitive::kSplat),
          Options(RenderMethod::kDeferred)};
}

struct Drawn {
  RenderResult result;
  size_t bytes = 0;
};

Drawn DrawAlone(const RenderScene& scene, double x, const RenderOptions& options) {
  Renderer renderer;
  const Shot novel = CameraAt(x);
  RenderResult result = renderer.Render(scene, novel.camera, novel.cam_from_world, options);
  return {std::move(result), renderer.gpu_bytes()};
}

TEST_F(GpuMemory, APictureDoesNotDependOnTheRoomThatHoldsIt) {
  const DtrSet set = ManyViews();
  const RenderScene scene = MakeRenderScene(set);
  for (const RenderOptions& options : EveryWay()) {
    std::vector<RenderResult> expected;
    RendererSettings settings;
    settings.gpu_bytes = 0;
    for (const double x : kWalk) {
      Drawn drawn = DrawAlone(scene, x, options);
      EXPECT_EQ(drawn.result.views_used.size(), 4u);
      settings.gpu_bytes = std::max(settings.gpu_bytes, drawn.bytes);
      expected.push_back(std::move(drawn.result));
    }
    int warnings = 0;
    settings.warn = [&](const std::string&) { ++warnings; };
    Renderer renderer(settings);
    size_t most = 0;
    for (size_t k = 0; k < std::size(kWalk); ++k) {
      // What another method leaves on the GPU must not take room from this one.
      const Shot novel = CameraAt(kWalk[k]);
      RenderOptions other = Options(RenderMethod::kDeferred);
      other.views = 1;
      renderer.Render(scene, novel.camera, novel.cam_from_world, other);
      ExpectSameBytes(expected[k],
                      renderer.Render(scene, novel.camera, novel.cam_from_world, options));
      most = std::max(most, renderer.gpu_bytes());
    }
    EXPECT_LE(most, settings.gpu_bytes);
    EXPECT_GT(most, settings.gpu_bytes / 2);
    EXPECT_EQ(warnings, 0);
  }
}

TEST_F(GpuMemory, DrawsFromTheNearestThatFitAndSaysSoOnce) {
  const DtrSet set = ManyViews();
  const RenderScene scene = MakeRenderScene(set);
  for (const RenderOptions& options : EveryWay()) {
    RenderOptions fewer = options;
    fewer.views = 2;
    RendererSettings settings;
    settings.gpu_bytes = DrawAlone(scene, 0.1, fewer).bytes;
    std::vector<std::string> warnings;
    settings.warn = [&](const std::string& line) { warnings.push_back(line); };
    Renderer renderer(settings);
    const Shot novel = CameraAt(0.1);
    for (int k = 0; k < 2; ++k) {
      const RenderResult found =
          renderer.Render(scene, novel.camera, novel.cam_from_world, options);
      ExpectSameBytes(DrawAlone(scene, 0.1, fewer).result, found);
      EXPECT_EQ(found.views_used.size(), 2u);
      EXPECT_LE(renderer.gpu_bytes(), settings.gpu_bytes);
    }
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("drawn from the nearest 2 of 4 views"), std::string::npos)
        << warnings[0];
    EXPECT_NE(warnings[0].find("`gpu_memory`"), std::string::npos);
    // Less than one view: one is drawn all the same.
    settings.gpu_bytes = 1;
    Renderer tiny(settings);
    EXPECT_EQ(tiny.Render(scene, novel.camera, novel.cam_from_world, options).views_used.size(),
              1u);
  }
}

TEST_F(GpuMemory, LayersAreUsedAgainAndEmptyArraysGo) {
  const StateGuard guard;
  TextureArrays arrays;
  const ImageSlot a = arrays.Take(GL_RGBA8, 64, 32, 2);
  const ImageSlot b = arrays.Take(GL_RGBA8, 64, 32, 2);
  EXPECT_EQ(a.array, b.array);
  EXPECT_NE(a.layer, b.layer);
  EXPECT_EQ(arrays.LayerBytes(a), 64u * 32 * 4);
  const ImageSlot depth = arrays.Take(GL_R16, 64, 32, 2);
  EXPECT_NE(depth.array, a.array);
  EXPECT_EQ(arrays.LayerBytes(depth), 64u * 32 * 2);
  arrays.Give(a);
  const ImageSlot again = arrays.Take(GL_RGBA8, 64, 32, 2);
  EXPECT_EQ(again.array, a.array);
  EXPECT_EQ(again.layer, a.layer);
  arrays.Give(again);
  arrays.Give(b);
  EXPECT_EQ(arrays.name(b.array), 0u);
  const ImageSlot other = arrays.Take(GL_RGBA8, 16, 16, 3);
  EXPECT_EQ(other.array, b.array);  // the index is free again
}

TEST_F(GpuMemory, WhatTheDriverCannotHoldIsRejectedInOneLine) {
  const StateGuard guard;
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  TextureArrays arrays;
  try {
    arrays.Take(GL_RGBA8, largest + 1, 4, 1);
    FAIL() << "a texture beyond the driver's limit";
  } catch (const Error& error) {
    const std::string line = error.what();
    EXPECT_NE(line.find("at most " + std::to_string(largest)), std::string::npos) << line;
    EXPECT_NE(line.find("`renderer` cpu"), std::string::npos) << line;
  }
}

/// What the driver says of it is not counted as ours.
class GpuMemoryFull : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    if (SharedContext(&why) == nullptr) GTEST_SKIP() << why;
  }
};

TEST_F(GpuMemoryFull, IsSaidInOneLine) {
  const StateGuard guard;
  GLint largest = 0, layers = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
  Targets targets;
  try {
    targets.Fit(largest, largest, layers);  // terabytes: no driver has them
    // NVIDIA's takes memory when it is first drawn into.
    if (!DrawsOnProcessor()) GTEST_SKIP() << "this driver promises memory that it does not have";
    FAIL() << "memory without end";
  } catch (const Error& error) {
    const std::string line = error.what();
    EXPECT_NE(line.find("out of GPU memory"), std::string::npos) << line;
    EXPECT_NE(line.find("`renderer` cpu"), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace dtr::gl
