// tests/simd/invariance.h -- what a rendered image must not depend on, for any renderer.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/simd/parity_scenes.h"
#include "tests/support/on_threads.h"

namespace dtr::testing {

/// `Renderer` draws by this method.
template <typename Renderer>
class InvarianceOf {
 public:
  explicit InvarianceOf(RenderMethod method) : method_(method) {}

  void ExpectNoOrderOfTheViews() {
    for (const NamedScene& scene : ParityScenes()) {
      const RenderResult expected = Draw(scene.set, scene.novel);
      DtrSet reversed = scene.set;
      std::reverse(reversed.frames[0].views.begin(), reversed.frames[0].views.end());
      ExpectSameBytes(expected, Draw(reversed, scene.novel));
      // A scene whose list is not sorted is drawn the same, too.
      RenderScene views = MakeRenderScene(scene.set);
      std::rotate(views.views.begin(), views.views.begin() + 2, views.views.end());
      Renderer renderer;
      ExpectSameBytes(expected, renderer.Render(views, scene.novel.camera,
                                                scene.novel.cam_from_world, OptionsOf(method_)));
    }
  }

  void ExpectNoThreadsOrEarlierRuns() {
    for (const NamedScene& scene : ParityScenes()) {
      const RenderResult expected = Draw(scene.set, scene.novel, 1);
      ExpectSameBytes(expected, Draw(scene.set, scene.novel, 3));
      ExpectSameBytes(expected, Draw(scene.set, scene.novel, 1));
      // Within one renderer, after another image.
      Renderer renderer;
      const RenderScene views = MakeRenderScene(scene.set);
      const View& input = *views.views.front();
      renderer.Render(views, input.camera, input.cam_from_world, OptionsOf(method_));
      ExpectSameBytes(expected, renderer.Render(views, scene.novel.camera,
                                                scene.novel.cam_from_world, OptionsOf(method_)));
    }
  }

  void ExpectNoUnitOfTheWorld() {
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

  void ExpectNoOriginOfTheWorld() {
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

 private:
  RenderResult Draw(const DtrSet& set, const Shot& novel, int threads = 0) {
    RenderOptions options = OptionsOf(method_);
    const ThreadLimit limit(threads);
    Renderer renderer;
    return renderer.Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
  }

  const RenderMethod method_;
};

}  // namespace dtr::testing
