// Parity on a set whose depth our own stereo makes: ragged edges, speckles, holes, wrong patches.
// Every pixel counts, those at depth edges too.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "dtr/cpu/renderer.h"
#include "dtr/simd/renderer.h"
#include "stereo/depth_maps.h"
#include "tests/simd/exact_scenes.h"
#include "tests/simd/whole_comparison.h"

namespace dtr::testing {
namespace {

/// Points that several views see, from their exact depth.
SparseScene SparsePointsOf(const std::vector<View>& views) {
  constexpr int kStepPx = 12;
  SparseScene scene;
  for (const View& view : views) {
    for (int y = kStepPx; y < view.depth.height(); y += kStepPx) {
      for (int x = kStepPx; x < view.depth.width(); x += kStepPx) {
        if (DepthImage::IsHole(view.depth(x, y))) continue;
        const int number = static_cast<int>(scene.points.size());
        const Eigen::Vector3d p =
            view.cam_from_world.Inverse() *
            view.camera.CamFromPixel({x + 0.5, y + 0.5}, view.depth(x, y), DepthKind::kPlaneZ);
        scene.points.push_back({p});
        for (size_t v = 0; v < views.size(); ++v) {
          const auto pixel = views[v].camera.PixelFromCam(views[v].cam_from_world * p);
          if (!pixel || !views[v].camera.Contains(*pixel)) continue;
          scene.observations.push_back({static_cast<int>(v), number, *pixel});
        }
      }
    }
  }
  std::sort(scene.observations.begin(), scene.observations.end(),
            [](const auto& a, const auto& b) { return a.view < b.view; });
  return scene;
}

/// The scene with the depth that stereo finds in its photos.
NamedScene WithOwnDepth(NamedScene scene) {
  std::vector<View>& views = scene.set.frames[0].views;
  const SparseScene sparse = SparsePointsOf(views);
  std::vector<stereo::StereoView> photos;
  for (const View& view : views) {
    photos.push_back({view.camera, view.cam_from_world, &view.image, nullptr});
  }
  const auto engine =
      stereo::MakeEngine("patchmatch", {.neighbours = 3, .iterations = 2, .passes = 0});
  stereo::DepthMapsOptions options;
  options.neighbours.count = engine->Neighbours();
  SilentProgress progress;
  std::vector<DepthImage> maps(views.size());
  stereo::ComputeDepthMaps(
      photos, sparse, *engine, options, progress, {},
      [&](int view, stereo::DepthEstimate&& estimate, const stereo::DepthRange&) {
        maps[static_cast<size_t>(view)] = std::move(estimate.depth);
      });
  for (size_t v = 0; v < views.size(); ++v) views[v].depth = std::move(maps[v]);
  FinishGeometry(scene.set);
  return scene;
}

TEST(OwnStereoParity, HoldsAtEveryPixel) {
  const NamedScene scene = WithOwnDepth(ExactScene("courtyard", 5, 192, 128));
  const RenderScene views = MakeRenderScene(scene.set);
  simd::Renderer renderer;
  WholeComparison all;
  for (const int resolution : {1, 2}) {
    RenderOptions options;
    options.resolution = resolution;
    const auto& [name, set, novel] = scene;
    const RenderResult expected = cpu::Render(views, novel.camera, novel.cam_from_world, options);
    const RenderResult found = renderer.Render(views, novel.camera, novel.cam_from_world, options);
    EXPECT_GT(expected.coverage_share, 0.3);
    EXPECT_LT(expected.coverage_share, 0.97) << "stereo leaves holes";
    all.Add(CompareWhole(expected, found));
  }
  std::printf("%s\n", all.Text().c_str());
  EXPECT_TRUE(all.Holds()) << all.Text();
}

}  // namespace
}  // namespace dtr::testing
