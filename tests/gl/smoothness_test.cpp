// The rendered image changes smoothly as the camera moves, also where the K nearest views change.
//
// The measure: along FlyThrough's path of 100 steps, the change of a frame is the largest change of
// any pixel (of 255, of three channels) from the frame before; pixels within 2 of a depth break
// (SPEC 2.3) in either frame, or unseen in either, are not evaluated; nor are those within 2 of the
// image's border, since breaks beyond it are not known. The largest change may be 3 times the
// median of all frames: texture that moves changes pixels, a view that pops changes them all at
// once.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "dtr/render/camera_path.h"
#include "tests/gl/gl_testing.h"
#include "tests/simd/comparison.h"
#include "tests/simd/exact_scenes.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;

constexpr int kSteps = 100, kBorderPx = 2;
constexpr double kLargestOfMedian = 3;

struct Smoothness {
  double largest = 0, median = 0;
  double judged_share = 0;
  double ratio() const { return largest / median; }
};

using Draw = std::function<RenderResult(const NovelCamera&, int frame)>;

Smoothness MeasureSmoothness(const RenderScene& views, const std::vector<NovelCamera>& path,
                             const RenderOptions& options, const Draw& draw) {
  const BreakRule rule = StrictestBreaks(views, options);
  Smoothness smoothness;
  std::vector<double> changes;
  RenderResult last;
  Mask last_breaks;
  for (size_t f = 0; f < path.size(); ++f) {
    RenderResult frame = draw(path[f], static_cast<int>(f));
    Mask breaks = NearBreaks(frame, rule);
    int largest = 0;
    long long judged = 0;
    for (int y = kBorderPx; f > 0 && y < breaks.height() - kBorderPx; ++y) {
      for (int x = kBorderPx; x < breaks.width() - kBorderPx; ++x) {
        if (breaks(x, y) != 0 || last_breaks(x, y) != 0) continue;
        if (frame.coverage(x, y) == 0 || last.coverage(x, y) == 0) continue;
        largest = std::max(largest, PixelDifference(frame.image, last.image, x, y));
        ++judged;
      }
    }
    if (f > 0) changes.push_back(largest);
    smoothness.judged_share += static_cast<double>(judged) /
                               static_cast<double>(breaks.data().size()) / (path.size() - 1.0);
    last = std::move(frame);
    last_breaks = std::move(breaks);
  }
  smoothness.largest = *std::max_element(changes.begin(), changes.end());
  const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
  std::nth_element(changes.begin(), middle, changes.end());
  smoothness.median = *middle;
  return smoothness;
}

struct PathCase {
  std::string scene;
  int views = 9;
  int width_px = 96, height_px = 64;
  std::vector<int> nearest = {2, 3, 8};  ///< K: of more views the nearest change along the path
  int finer = 1;  ///< of a path of so many times the steps the middle hundred
};

std::vector<NovelCamera> PathOf(const PathCase& test, const DtrSet& set) {
  const std::vector<NovelCamera> whole = FlyThrough(set, test.finer * kSteps + 1);
  const auto first = whole.begin() + (test.finer - 1) * kSteps / 2;
  return {first, first + kSteps + 1};
}

class SmoothPath : public GlTest, public ::testing::WithParamInterface<PathCase> {};

TEST_P(SmoothPath, ChangesByNoMoreThanThriceTheMedian) {
  const PathCase& test = GetParam();
  const NamedScene scene =
      ExactOrDamagedScene(test.scene, test.views, test.width_px, test.height_px);
  const RenderScene views = MakeRenderScene(scene.set);
  const std::vector<NovelCamera> path = PathOf(test, scene.set);
  Renderer renderer;
  for (const RenderMethod method : kBothMethods) {
    for (const int nearest : test.nearest) {
      RenderOptions options = OptionsOf(method);
      options.views = nearest;
      const Smoothness s =
          MeasureSmoothness(views, path, options, [&](const NovelCamera& novel, int) {
            return renderer.Render(views, novel.camera, novel.cam_from_world, options);
          });
      std::printf(
          "%-10s %d views %-8s K = %d: largest change %.0f, median %.0f, %.2f times; judged %.0f "
          "%%\n",
          test.scene.c_str(), test.views,
          method == RenderMethod::kTwoPass ? "two-pass" : "deferred", nearest, s.largest, s.median,
          s.ratio(), 100 * s.judged_share);
      EXPECT_LE(s.ratio(), kLargestOfMedian);
      EXPECT_GT(s.judged_share, 0.2);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, SmoothPath,
                         ::testing::Values(PathCase{"courtyard"}, PathCase{"stairs"},
                                           PathCase{"damaged"},
                                           // Not K = 2: what only one of two views shows goes at
                                           // once when another takes its place.
                                           PathCase{"plane", 5, 96, 64, {3, 8}},
                                           PathCase{"courtyard", 9, 144, 96, {3}, 8}),
                         [](const auto& test) {
                           return test.param.scene + std::to_string(test.param.views) + "views" +
                                  (test.param.finer > 1 ? "fine" : "");
                         });

using Smooth = GlTest;

TEST_F(Smooth, TheMeasureWouldSeeAPop) {
  const NamedScene scene = ExactOrDamagedScene("stairs", 9, 96, 64);
  const RenderScene views = MakeRenderScene(scene.set);
  const std::vector<NovelCamera> path = FlyThrough(scene.set, kSteps + 1);
  Renderer renderer;
  for (const bool pops : {false, true}) {
    const Smoothness s =
        MeasureSmoothness(views, path, {}, [&](const NovelCamera& novel, int frame) {
          // The pop: for one frame the image of a place 12 steps ahead.
          const NovelCamera& from = pops && frame == 40 ? path[52] : novel;
          return renderer.Render(views, from.camera, from.cam_from_world, {});
        });
    EXPECT_EQ(s.ratio() <= kLargestOfMedian, !pops) << s.largest << " " << s.median;
  }
}

}  // namespace
}  // namespace dtr::gl
