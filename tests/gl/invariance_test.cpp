// What the image must not depend on, both methods.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/gl/gl_testing.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;

/// What draws: on a machine without a GPU the deferred method has two ways.
struct Way {
  const char* name;
  RenderMethod method;
  CoarseDrawer drawer;
};

class Invariance : public GlTest, public ::testing::WithParamInterface<Way> {
 protected:
  Invariance() { settings_.coarse_drawer = GetParam().drawer; }

  RenderResult Draw(const DtrSet& set, const Shot& novel, int threads = 0) {
    RenderOptions options = OptionsOf(GetParam().method);
    options.threads = threads;
    Renderer renderer(settings_);
    return renderer.Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
  }

  RendererSettings settings_;
};

INSTANTIATE_TEST_SUITE_P(
    , Invariance,
    ::testing::Values(Way{"TwoPass", RenderMethod::kTwoPass, CoarseDrawer::kFitting},
                      Way{"Deferred", RenderMethod::kDeferred, CoarseDrawer::kFitting},
                      Way{"DeferredByShaders", RenderMethod::kDeferred, CoarseDrawer::kShaders}),
    [](const auto& test) { return test.param.name; });

TEST_P(Invariance, OrderOfTheViews) {
  for (const NamedScene& scene : ParityScenes()) {
    const RenderResult expected = Draw(scene.set, scene.novel);
    DtrSet reversed = scene.set;
    std::reverse(reversed.frames[0].views.begin(), reversed.frames[0].views.end());
    ExpectSameBytes(expected, Draw(reversed, scene.novel));
    // A scene whose list is not sorted is drawn the same, too.
    RenderScene views = MakeRenderScene(scene.set);
    std::rotate(views.views.begin(), views.views.begin() + 2, views.views.end());
    Renderer renderer(settings_);
    ExpectSameBytes(expected, renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world,
                                              OptionsOf(GetParam().method)));
  }
}

TEST_P(Invariance, ThreadsAndRepeatedRuns) {
  for (const NamedScene& scene : ParityScenes()) {
    const RenderResult expected = Draw(scene.set, scene.novel, 1);
    ExpectSameBytes(expected, Draw(scene.set, scene.novel, 3));
    ExpectSameBytes(expected, Draw(scene.set, scene.novel, 1));
    // Within one renderer, after another image.
    Renderer renderer(settings_);
    const RenderScene views = MakeRenderScene(scene.set);
    const View& input = *views.views.front();
    renderer.Render(views, input.camera, input.cam_from_world, OptionsOf(GetParam().method));
    ExpectSameBytes(expected, renderer.Render(views, scene.novel.camera, scene.novel.cam_from_world,
                                              OptionsOf(GetParam().method)));
  }
}

TEST_P(Invariance, UnitOfTheWorld) {
  for (const NamedScene& scene : ParityScenes()) {
    const RenderResult expected = Draw(scene.set, scene.novel);
    for (const double scale : {1e-3, 0.1, 7.0, 1e3}) {
      EXPECT_LE(ShareApart(expected, Draw(Moved(scene.set, scale, {0, 0, 0}),
                                          Moved(scene.novel, scale, {0, 0, 0}))),
                kOutlineShare)
          << scene.name << " x " << scale;
    }
  }
}

TEST_P(Invariance, OriginOfTheWorld) {
  for (const NamedScene& scene : ParityScenes()) {
    const RenderResult expected = Draw(scene.set, scene.novel);
    for (const Eigen::Vector3d& offset :
         {Eigen::Vector3d(5e5, 4.5e6, 100), Eigen::Vector3d(1e7, -1e7, 1e7)}) {
      EXPECT_LE(
          ShareApart(expected, Draw(Moved(scene.set, 1, offset), Moved(scene.novel, 1, offset))),
          kOutlineShare)
          << scene.name << " at " << offset.transpose();
    }
  }
}

}  // namespace
}  // namespace dtr::gl
