#include "dtr/gl/renderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/cpu/renderer.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/layer_sizes.h"
#include "dtr/gl/objects.h"
#include "dtr/render/triangulation.h"
#include "tests/gl/gl_testing.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;
using Render = GlTest;

RenderResult RenderOnce(const DtrSet& set, const Shot& novel, const RenderOptions& options = {}) {
  Renderer renderer;
  return renderer.Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
}

TEST_F(Render, AnInputCameraAloneGivesItsOwnImageBack) {
  const DtrSet set = SquareBeforePlane();
  const View& view = set.frames[0].views[1];
  for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
    RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
    options.views = 1;
    options.primitive = primitive;
    Renderer renderer;
    const RenderResult result =
        renderer.Render(MakeRenderScene(set), view.camera, view.cam_from_world, options);
    EXPECT_EQ(result.coverage_share, 1);
    EXPECT_LE(LargestDifference(result.image, view.image), 1);
  }
}

TEST_F(Render, RepeatedCallsGiveTheSameBytes) {
  const NamedScene scene = ParityScenes()[1];
  const RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  const auto render = [&](const RenderOptions& options) {
    return renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, options);
  };
  const RenderResult first = render({});
  RenderOptions splats = OptionsOf(RenderMethod::kTwoPass);
  splats.primitive = Primitive::kSplat;
  splats.resolution = 2;
  render(splats);
  ExpectSameBytes(first, render({}));
  renderer.Forget();
  ExpectSameBytes(first, render({}));
  ExpectSameBytes(first, RenderOnce(scene.set, scene.novel));
}

TEST_F(Render, APictureLeftOnTheGpuIsTheOneThatRenderReads) {
  const NamedScene scene = ParityScenes()[1];
  const RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  EXPECT_THROW(renderer.ReadBack(), std::logic_error);
  for (const RenderMethod method : {RenderMethod::kTwoPass, RenderMethod::kDeferred}) {
    RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
    options.method = method;
    options.fill_holes = options.smooth_edges = true;  // Draw does neither
    const DrawnFrame drawn =
        renderer.Draw(views, scene.novel.camera, scene.novel.cam_from_world, options);
    EXPECT_TRUE(glIsTexture(drawn.image) && glIsTexture(drawn.depth) && glIsTexture(drawn.marks));
    EXPECT_EQ(drawn.width_px, scene.novel.camera.width_px());
    EXPECT_EQ(drawn.height_px, scene.novel.camera.height_px());
    const RenderResult read = renderer.ReadBack();
    options.fill_holes = options.smooth_edges = false;
    const RenderResult rendered =
        renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, options);
    ExpectSameBytes(read, rendered);
    EXPECT_EQ(read.views_used, rendered.views_used);
    EXPECT_EQ(drawn.views_used, rendered.views_used);
    EXPECT_EQ(read.coverage_share, rendered.coverage_share);
    EXPECT_GT(read.coverage_share, 0.5);
    EXPECT_THROW(renderer.ReadBack(), std::logic_error);
    RendererSettings little_memory;
    little_memory.layer_bytes = 1;  // Render would go row by row
    Renderer whole(little_memory);
    whole.Draw(views, scene.novel.camera, scene.novel.cam_from_world, options);
    ExpectSameBytes(whole.ReadBack(), rendered);
  }
  RenderOptions nothing_valid;
  nothing_valid.max_angle_rad = 1e-9;
  renderer.Draw(views, scene.novel.camera, scene.novel.cam_from_world, nothing_valid);
  const RenderResult empty = renderer.ReadBack();
  EXPECT_EQ(empty.coverage_share, 0);
  ExpectSound(empty);
}

TEST_F(Render, WithoutClipControlTheSameIsSeen) {
  RendererSettings plain;
  plain.only_opengl_43 = true;
  for (const NamedScene& scene : ParityScenes()) {
    Renderer renderer(plain);
    const RenderResult found = renderer.Render(MakeRenderScene(scene.set), scene.novel.camera,
                                               scene.novel.cam_from_world, {});
    EXPECT_LE(ShareApart(RenderOnce(scene.set, scene.novel), found), kOutlineShare) << scene.name;
    ExpectSound(found);
  }
}

TEST_F(Render, ALargePictureIsDrawnInBandsWithoutASeam) {
  for (const NamedScene& scene : ParityScenes()) {
    const RenderScene views = MakeRenderScene(scene.set);
    for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
      RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
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
  const GLenum on[] = {GL_POLYGON_OFFSET_FILL, GL_DEPTH_TEST, GL_SCISSOR_TEST,
                       GL_CULL_FACE,           GL_BLEND,      GL_PRIMITIVE_RESTART};
  for (const GLenum name : on) glEnable(name);
  glViewport(3, 5, 70, 90);
  glDepthFunc(GL_NOTEQUAL);
  glDepthMask(GL_FALSE);
  glDepthRange(0.25, 0.75);
  if (HasClipControl()) glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
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
  glBindImageTexture(1, texture.name(), 0, GL_TRUE, 0, GL_READ_WRITE, GL_R32UI);
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
  EXPECT_EQ(value(GL_DEPTH_FUNC)[0], GL_NOTEQUAL);
  GLboolean depth_mask = GL_TRUE;
  glGetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask);
  EXPECT_EQ(depth_mask, GL_FALSE);
  GLdouble depth_range[2];
  glGetDoublev(GL_DEPTH_RANGE, depth_range);
  EXPECT_EQ(depth_range[0], 0.25);
  EXPECT_EQ(depth_range[1], 0.75);
  if (HasClipControl()) {
    EXPECT_EQ(value(GL_CLIP_ORIGIN)[0], GL_UPPER_LEFT);
    EXPECT_EQ(value(GL_CLIP_DEPTH_MODE)[0], GL_ZERO_TO_ONE);
    glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  }
  glDepthMask(GL_TRUE);
  glDepthRange(0, 1);
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
  const auto image_unit_1 = [](GLenum name) {
    GLint v = 0;
    glGetIntegeri_v(name, 1, &v);
    return v;
  };
  EXPECT_EQ(image_unit_1(GL_IMAGE_BINDING_NAME), static_cast<GLint>(texture.name()));
  EXPECT_EQ(image_unit_1(GL_IMAGE_BINDING_LAYERED), GL_TRUE);
  EXPECT_EQ(image_unit_1(GL_IMAGE_BINDING_ACCESS), GL_READ_WRITE);
  EXPECT_EQ(image_unit_1(GL_IMAGE_BINDING_FORMAT), GL_R32UI);
  glBindImageTexture(1, 0, 0, GL_FALSE, 0, GL_READ_ONLY, GL_R8);
  GLboolean mask[4];
  glGetBooleanv(GL_COLOR_WRITEMASK, mask);
  EXPECT_EQ(std::vector<GLboolean>(mask, mask + 4),
            (std::vector<GLboolean>{GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE}));

  for (const GLenum name : on) glDisable(name);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

/// Photos of `count` sizes around a scene, each with depth at its own scale.
DtrSet OfManySizes(int count) {
  const Surface surface = Union(Square(0.3, 0.2, 5, 1), Plane({0.2, 0, 1}, 9));
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / count;
    Shot shot = ShotFrom("v" + std::to_string(100 + i),
                         {0.7 * std::cos(angle), 0.5 * std::sin(angle), 0.02 * i}, {0, 0, 9});
    const PinholeCamera& c = shot.camera;
    const int width = c.width_px() + 4 * i, height = c.height_px() - 2 * i;
    shot.camera = PinholeCamera(width, height, c.fx_px(), c.fy_px(), 0.5 * width, 0.5 * height);
    shot.depth_scale = 1 + i % 2;
    views.push_back(Photograph(surface, shot));
  }
  return SetOf(std::move(views));
}

TEST_F(Render, ViewsOfAnyNumberOfSizesMakeOnePicture) {
  const DtrSet set = OfManySizes(20);
  const RenderScene scene = MakeRenderScene(set);
  const Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
  for (const RenderMethod method : {RenderMethod::kTwoPass, RenderMethod::kDeferred}) {
    RenderOptions options = OptionsOf(method);
    options.views = 20;
    Renderer renderer;
    const RenderResult found = renderer.Render(scene, novel.camera, novel.cam_from_world, options);
    EXPECT_EQ(found.views_used.size(), 20u);
    const RenderResult expected = cpu::Render(scene, novel.camera, novel.cam_from_world, options);
    EXPECT_LE(ShareApart(expected, found), kOutlineShare);
    // Few sizes lie in layers of their own: the same image but for how it is added up. The view
    // after the last one stays, for the others fade by its angle.
    options.views = 4;
    RenderScene few = scene;
    few.views.clear();
    for (const int i :
         renderer.Render(scene, novel.camera, novel.cam_from_world, options).views_used) {
      few.views.push_back(scene.views[static_cast<size_t>(i)]);
    }
    options.views = 3;
    const RenderResult padded = renderer.Render(scene, novel.camera, novel.cam_from_world, options);
    Renderer fresh;
    EXPECT_LE(ShareApart(fresh.Render(few, novel.camera, novel.cam_from_world, options), padded),
              kOutlineShare);
    ExpectSound(padded);
  }
}

// The product of two weights of one pixel need not fit float32 though each of them does.
TEST_F(Render, LargePowersOfTheInverseAngleDrawWhatTheReferenceDraws) {
  const DtrSet set = OfManySizes(5);
  const RenderScene scene = MakeRenderScene(set);
  const View& photo = set.frames[0].views[2];
  for (const int power : {1, 10, 13, 16, 20}) {
    RenderOptions options = OptionsOf(RenderMethod::kDeferred);
    options.blend_k = power;
    const RenderResult expected = cpu::Render(scene, photo.camera, photo.cam_from_world, options);
    EXPECT_GT(expected.coverage_share, 0.5);
    Renderer renderer;
    const RenderResult found = renderer.Render(scene, photo.camera, photo.cam_from_world, options);
    EXPECT_LE(ShareApart(expected, found), kOutlineShare) << power;
    ExpectSound(found);
  }
}

TEST(LayerSizes, AreTheViewsOwnWhereTheseAreFewAndElseFewAndLargeEnough) {
  const DtrSet set = OfManySizes(20);
  std::vector<const View*> views;
  for (const View& view : set.frames[0].views) views.push_back(&view);
  constexpr int kLimit = 4096;
  const LayerSizes own({views.begin(), views.begin() + 5}, 1, kLimit);
  EXPECT_EQ(own.step_px(), 1);
  EXPECT_EQ(own.LayerFor({97, 63}), (LayerSize{97, 63}));
  for (const int resolution : {1, 3}) {
    const LayerSizes few(views, resolution, kLimit);
    std::set<LayerSize> images, depths;
    for (const View* view : views) {
      const LayerSize image{view->image.width(), view->image.height()};
      const LayerSize layer = few.LayerFor(image), depth = PackedDepthSize(*view, resolution);
      EXPECT_GE(layer.width_px, image.width_px);
      EXPECT_GE(layer.height_px, image.height_px);
      EXPECT_GE(few.LayerFor(depth).width_px, depth.width_px);
      const SampleGrid samples = MakeSampleGrid(*view, resolution);
      EXPECT_EQ(depth,
                PackedDepthSize(samples.inverse_depth.width(), samples.inverse_depth.height()));
      images.insert(layer);
      depths.insert(few.LayerFor(depth));
    }
    EXPECT_LE(images.size(), static_cast<size_t>(LayerSizes::kMaxSizes));
    EXPECT_LE(depths.size(), static_cast<size_t>(LayerSizes::kMaxSizes));
  }
  const LayerSizes tight(views, 1, 100);  // no layer beyond the driver's limit
  EXPECT_LE(tight.LayerFor({97, 63}).width_px, 100);
  const std::vector<int> edge = WithEdge(std::vector<int>{1, 2, 3, 4}.data(), {2, 2}, 1, {3, 3});
  EXPECT_EQ(edge, (std::vector<int>{1, 2, 2, 3, 4, 4, 3, 4, 4}));
}

// Hosts such as OpenSceneGraph bind parts of buffers and cut with clip planes.
TEST_F(Render, LeavesBufferRangesClipDistancesAndStateOfDrawBuffersAsTheyWere) {
  const Buffer buffer = Buffer::Make();
  glBindBuffer(GL_UNIFORM_BUFFER, buffer.name());
  glBufferData(GL_UNIFORM_BUFFER, 4096, nullptr, GL_STATIC_DRAW);
  constexpr GLint64 kStart = 512, kSize = 256;  // any driver's alignment is a divisor of 256
  glBindBufferRange(GL_UNIFORM_BUFFER, 0, buffer.name(), kStart, kSize);
  for (const GLuint i : {0u, 1u, 2u, 3u}) {
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, i, buffer.name(), kStart + 256 * i, kSize);
  }
  glEnable(GL_CLIP_DISTANCE0);
  glEnable(GL_CLIP_DISTANCE3);
  glEnablei(GL_BLEND, 2);
  glColorMaski(1, GL_FALSE, GL_TRUE, GL_FALSE, GL_TRUE);

  for (const RenderMethod method : {RenderMethod::kTwoPass, RenderMethod::kDeferred}) {
    const NamedScene scene = ParityScenes().front();
    EXPECT_GT(RenderOnce(scene.set, scene.novel, OptionsOf(method)).coverage_share, 0.3);
    const auto expect_range = [&](GLenum start, GLenum size, GLuint index, GLint64 expected) {
      GLint64 value = 0;
      glGetInteger64i_v(start, index, &value);
      EXPECT_EQ(value, expected) << index;
      glGetInteger64i_v(size, index, &value);
      EXPECT_EQ(value, kSize) << index;
    };
    expect_range(GL_UNIFORM_BUFFER_START, GL_UNIFORM_BUFFER_SIZE, 0, kStart);
    for (const GLuint i : {0u, 1u, 2u, 3u}) {
      expect_range(GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE, i,
                   kStart + 256 * i);
    }
    for (GLuint i = 0; i < 6; ++i) {
      EXPECT_EQ(glIsEnabled(GL_CLIP_DISTANCE0 + i), i == 0 || i == 3) << i;
      EXPECT_EQ(glIsEnabledi(GL_BLEND, i), i == 2) << i;
      GLboolean mask[4];
      glGetBooleani_v(GL_COLOR_WRITEMASK, i, mask);
      EXPECT_EQ(mask[0], i != 1) << i;
      EXPECT_TRUE(mask[1]) << i;
    }
  }
  glDisable(GL_CLIP_DISTANCE0);
  glDisable(GL_CLIP_DISTANCE3);
  glDisablei(GL_BLEND, 2);
  glColorMaski(1, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  for (const GLuint i : {0u, 1u, 2u, 3u}) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, 0);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, 0);
}

TEST_F(Render, DepthBeyondAStorageBlockGoesInBandsOrIsRejectedNamingTheLimit) {
  const NamedScene scene = ParityScenes()[1];
  const RenderScene views = MakeRenderScene(scene.set);
  RendererSettings small;
  small.max_storage_bytes = 4 * 96 * 10;  // ten rows
  Renderer renderer(small);
  const RenderResult banded =
      renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world, {});
  EXPECT_LE(ShareApart(RenderOnce(scene.set, scene.novel), banded), kOutlineShare);
  try {
    renderer.Draw(views, scene.novel.camera, scene.novel.cam_from_world, {});
    FAIL() << "it was drawn";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("storage block of 3840 bytes"), std::string::npos)
        << error.what();
  }
  RenderOptions two_pass = OptionsOf(RenderMethod::kTwoPass);
  renderer.Draw(views, scene.novel.camera, scene.novel.cam_from_world, two_pass);
}

TEST_F(Render, WhatCannotBeDrawnIsNamed) {
  const NamedScene scene = ParityScenes().front();
  Renderer renderer;
  const RenderScene views = MakeRenderScene(scene.set);
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
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
