#include "dtr/gl/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/gl/objects.h"
#include "tests/gl/gl_testing.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;
using Render = GlTest;

// Single precision moves a vertex by 1e-4 px at most; a pixel on an outline may change hands, any
// other by one level of 255.
constexpr int kSameLevels = 1;
constexpr double kOutlineShare = 0.005;

RenderResult RenderOnce(const DtrSet& set, const Shot& novel, const RenderOptions& options = {}) {
  Renderer renderer;
  return renderer.Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
}

double ShareApart(const RenderResult& a, const RenderResult& b) {
  long long apart = 0;
  for (int y = 0; y < a.image.height(); ++y) {
    for (int x = 0; x < a.image.width(); ++x) {
      apart += PixelDifference(a.image, b.image, x, y) > kSameLevels ||
               a.coverage(x, y) != b.coverage(x, y);
    }
  }
  return static_cast<double>(apart) / static_cast<double>(a.coverage.data().size());
}

void ExpectSound(const RenderResult& result) {
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

/// The world scaled and moved; the picture must not know.
DtrSet Moved(DtrSet set, double scale, const Eigen::Vector3d& offset) {
  for (View& view : set.frames[0].views) {
    const Eigen::Vector3d centre = scale * view.CenterInWorld() + offset;
    view.cam_from_world.translation = -(view.cam_from_world.rotation * centre);
    for (float& depth : view.depth.grid().data()) depth *= static_cast<float>(scale);
  }
  FinishGeometry(set);
  return set;
}
Shot Moved(Shot shot, double scale, const Eigen::Vector3d& offset) {
  const Eigen::Vector3d centre = scale * shot.cam_from_world.TargetOriginInSource() + offset;
  shot.cam_from_world.translation = -(shot.cam_from_world.rotation * centre);
  return shot;
}

TEST_F(Render, AnInputCameraAloneGivesItsOwnImageBack) {
  const DtrSet set = SquareBeforePlane();
  const View& view = set.frames[0].views[1];
  for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
    RenderOptions options;
    options.views = 1;
    options.primitive = primitive;
    Renderer renderer;
    const RenderResult result =
        renderer.Render(MakeRenderScene(set), view.camera, view.cam_from_world, options);
    EXPECT_EQ(result.coverage_share, 1);
    EXPECT_LE(LargestDifference(result.image, view.image), 1);
  }
}

TEST_F(Render, DoesNotDependOnTheOrderOfTheViews) {
  const NamedScene scene = ParityScenes()[1];
  DtrSet reversed = scene.set;
  std::reverse(reversed.frames[0].views.begin(), reversed.frames[0].views.end());
  ExpectSameBytes(RenderOnce(scene.set, scene.novel), RenderOnce(reversed, scene.novel));
  // A scene whose list is not sorted is drawn the same, too.
  RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  const RenderResult expected =
      renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, {});
  std::rotate(views.views.begin(), views.views.begin() + 2, views.views.end());
  ExpectSameBytes(expected,
                  renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, {}));
}

TEST_F(Render, RepeatedCallsGiveTheSameBytes) {
  const NamedScene scene = ParityScenes()[1];
  const RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  const auto render = [&](const RenderOptions& options) {
    return renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, options);
  };
  const RenderResult first = render({});
  RenderOptions splats;
  splats.primitive = Primitive::kSplat;
  splats.resolution = 2;
  render(splats);
  ExpectSameBytes(first, render({}));
  renderer.Forget();
  ExpectSameBytes(first, render({}));
  ExpectSameBytes(first, RenderOnce(scene.set, scene.novel));
}

TEST_F(Render, DoesNotDependOnTheUnitOrTheOriginOfTheWorld) {
  for (const NamedScene& scene : ParityScenes()) {
    const RenderResult expected = RenderOnce(scene.set, scene.novel);
    for (const double scale : {1e-3, 1e3}) {
      EXPECT_LE(ShareApart(expected, RenderOnce(Moved(scene.set, scale, {0, 0, 0}),
                                                Moved(scene.novel, scale, {0, 0, 0}))),
                kOutlineShare)
          << scene.name << " x " << scale;
    }
    const Eigen::Vector3d offset(1e7, -1e7, 1e7);
    EXPECT_LE(ShareApart(expected,
                         RenderOnce(Moved(scene.set, 1, offset), Moved(scene.novel, 1, offset))),
              kOutlineShare)
        << scene.name << " at 1e7";
  }
}

TEST_F(Render, RandomCamerasGiveNoNanAndNoContradiction) {
  const std::vector<NamedScene> scenes = ParityScenes();
  Random random(11);
  for (const NamedScene& scene : scenes) {
    const RenderScene views = MakeRenderScene(scene.set);
    Renderer renderer;
    for (int k = 0; k < 40; ++k) {
      Shot shot;
      const double degrees = k % 4 == 0 ? 170 : k % 4 == 1 ? 5 : random.Uniform(20, 120);
      const int width = k % 7 == 0 ? 1 : 48, height = k % 7 == 0 ? 1 : 36;
      const double focal = 0.5 * width / std::tan(degrees / 360 * 3.14159265358979323846);
      shot.camera = PinholeCamera(width, height, focal, focal, width / 2.0, height / 2.0);
      const View& near =
          *views.views[static_cast<size_t>(random.Index(static_cast<int>(views.views.size())))];
      // At an input camera, inside the geometry, anywhere.
      const double reach = k % 3 == 0 ? 0 : k % 3 == 1 ? 1e-4 : 12;
      const Eigen::Vector3d centre =
          near.CenterInWorld() +
          reach * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
      shot.cam_from_world = LookAt(centre, {random.Normal(), random.Normal(), 8});
      RenderOptions options;
      options.primitive = k % 2 == 0 ? Primitive::kMesh : Primitive::kSplat;
      options.blend = kAllWeights[k % 5];
      options.method = k % 3 == 1 ? RenderMethod::kDeferred : RenderMethod::kTwoPass;
      options.max_angle_rad = std::numbers::pi;
      options.exponent = k % 5 == 0 ? 1000 : 8;
      ExpectSound(renderer.Render(views, shot.camera, shot.cam_from_world, options));
    }
  }
}

TEST_F(Render, NoViewAndNoDepthGiveAnEmptyPicture) {
  DtrSet set = SquareBeforePlane();
  const Shot behind = ShotFrom("n", {0, 0, 30}, {0, 0, 10});
  const RenderResult none = RenderOnce(set, behind);
  EXPECT_TRUE(none.views_used.empty());
  EXPECT_EQ(none.coverage_share, 0);
  ExpectSound(none);
  for (View& view : set.frames[0].views) {
    std::fill(view.depth.grid().data().begin(), view.depth.grid().data().end(), 0.0f);
  }
  for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
    RenderOptions options;
    options.primitive = primitive;
    const RenderResult holes = RenderOnce(set, ShotFrom("n", {0, 0, 0}, {0, 0, 10}), options);
    EXPECT_EQ(holes.coverage_share, 0);
    ExpectSound(holes);
  }
}

TEST_F(Render, ALargePictureIsDrawnInBandsWithoutASeam) {
  for (const NamedScene& scene : ParityScenes()) {
    const RenderScene views = MakeRenderScene(scene.set);
    for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
      RenderOptions options;
      options.primitive = primitive;
      Renderer whole;
      Renderer banded({"", 20000});  // some 10 rows of 96 pixels from 5 views
      const RenderResult a =
          whole.Render(views, scene.novel.camera, scene.novel.cam_from_world, options);
      const RenderResult b =
          banded.Render(views, scene.novel.camera, scene.novel.cam_from_world, options);
      EXPECT_LE(ShareApart(a, b), kOutlineShare) << scene.name;
      ExpectSound(b);
    }
  }
}

TEST_F(Render, LeavesTheContextsStateAsItWas) {
  const GLenum on[] = {GL_DEPTH_TEST, GL_SCISSOR_TEST, GL_CULL_FACE, GL_BLEND,
                       GL_PRIMITIVE_RESTART};
  for (const GLenum name : on) glEnable(name);
  glViewport(3, 5, 70, 90);
  glBlendEquation(GL_FUNC_REVERSE_SUBTRACT);
  glCullFace(GL_FRONT);
  glFrontFace(GL_CW);
  glPixelStorei(GL_PACK_ALIGNMENT, 8);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 17);
  glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
  const Texture texture = Texture::Make();
  const Buffer buffer = Buffer::Make();
  const VertexArray array = VertexArray::Make();
  const Framebuffer framebuffer = Framebuffer::Make();
  glActiveTexture(GL_TEXTURE3);
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
  glBindVertexArray(array.name());
  glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffer.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer.name());

  const NamedScene scene = ParityScenes().front();
  EXPECT_GT(RenderOnce(scene.set, scene.novel).coverage_share, 0.3);

  for (const GLenum name : on) EXPECT_TRUE(glIsEnabled(name)) << name;
  const auto value = [](GLenum name) {
    GLint v[4] = {};
    glGetIntegerv(name, v);
    return std::vector<GLint>(v, v + 4);
  };
  EXPECT_EQ(value(GL_VIEWPORT), (std::vector<GLint>{3, 5, 70, 90}));
  EXPECT_EQ(value(GL_BLEND_EQUATION_RGB)[0], GL_FUNC_REVERSE_SUBTRACT);
  EXPECT_EQ(value(GL_CULL_FACE_MODE)[0], GL_FRONT);
  EXPECT_EQ(value(GL_FRONT_FACE)[0], GL_CW);
  EXPECT_EQ(value(GL_PACK_ALIGNMENT)[0], 8);
  EXPECT_EQ(value(GL_UNPACK_ROW_LENGTH)[0], 17);
  EXPECT_EQ(value(GL_ACTIVE_TEXTURE)[0], GL_TEXTURE3);
  EXPECT_EQ(value(GL_TEXTURE_BINDING_2D_ARRAY)[0], static_cast<GLint>(texture.name()));
  EXPECT_EQ(value(GL_VERTEX_ARRAY_BINDING)[0], static_cast<GLint>(array.name()));
  EXPECT_EQ(value(GL_ARRAY_BUFFER_BINDING)[0], static_cast<GLint>(buffer.name()));
  EXPECT_EQ(value(GL_DRAW_FRAMEBUFFER_BINDING)[0], static_cast<GLint>(framebuffer.name()));
  EXPECT_EQ(value(GL_READ_FRAMEBUFFER_BINDING)[0], 0);
  EXPECT_EQ(value(GL_CURRENT_PROGRAM)[0], 0);
  GLint storage = 0;
  glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, 0, &storage);
  EXPECT_EQ(storage, static_cast<GLint>(buffer.name()));
  GLboolean mask[4];
  glGetBooleanv(GL_COLOR_WRITEMASK, mask);
  EXPECT_EQ(std::vector<GLboolean>(mask, mask + 4),
            (std::vector<GLboolean>{GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE}));

  for (const GLenum name : on) glDisable(name);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

TEST_F(Render, WhatCannotBeDrawnIsNamed) {
  const NamedScene scene = ParityScenes().front();
  Renderer renderer;
  const RenderScene views = MakeRenderScene(scene.set);
  RenderOptions options;
  options.views = 0;
  EXPECT_THROW(renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, options),
               UsageError);
  Pose broken = scene.novel.cam_from_world;
  broken.translation.x() = std::nan("");
  EXPECT_THROW(renderer.Render(views, scene.novel.camera, broken, {}), Error);
  const PinholeCamera wide(100000, 4, 100, 100, 50000, 2);
  EXPECT_THROW(renderer.Render(views, wide, scene.novel.cam_from_world, {}), Error);
}

}  // namespace
}  // namespace dtr::gl
