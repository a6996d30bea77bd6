#include "viewer/wireframe.h"

#include <gtest/gtest.h>

#include "datasets/exact/analytic_scene.h"
#include "dtr/cpu/renderer.h"
#include "tests/support/on_threads.h"

namespace dtr::viewer {
namespace {

using testing::Photograph;
using testing::Plane;
using testing::Shot;

/// Two views of a plane at z = 10; the image is the first one's own.
class WireframeTest : public ::testing::Test {
 protected:
  WireframeTest() {
    set_.frames.resize(1);
    for (const double x : {0.0, 1.2}) {
      Shot shot;
      shot.id = "v" + std::to_string(set_.frames[0].views.size());
      shot.cam_from_world = testing::LookAt({x, 0, 0}, {0, 0, 10});
      set_.frames[0].views.push_back(Photograph(Plane({0, 0, 1}, 10), shot));
      set_.frames[0].views.back().reference_baseline = 1;
    }
    set_.scene_center = {0, 0, 10};
    colours_ = ViewColours(set_);
    scene_ = MakeRenderScene(set_);
    const View& first = set_.frames[0].views[0];
    novel_ = {first.camera, first.cam_from_world};
  }
  RenderResult Rendered() const {
    return cpu::Render(scene_, novel_.camera, novel_.cam_from_world, options_);
  }
  ImageRgb8 Drawn(const RenderResult& result) {
    return wireframe_.Draw({result, scene_, novel_, options_, colours_});
  }
  bool Has(const ImageRgb8& image, int x, int y, int view) const {
    const Rgb colour = colours_.Of(set_.frames[0].views[static_cast<size_t>(view)]);
    for (int c = 0; c < 3; ++c) {
      if (image(x, y, c) != colour[static_cast<size_t>(c)]) return false;
    }
    return true;
  }
  int InColumn(const ImageRgb8& image, int x, int view) const {
    int count = 0;
    for (int y = 0; y < image.height(); ++y) count += Has(image, x, y, view);
    return count;
  }

  DtrSet set_;
  ViewColours colours_;
  RenderScene scene_;
  NovelCamera novel_;
  RenderOptions options_;
  Wireframe wireframe_;
};

TEST_F(WireframeTest, DrawsTheEdgesOfAPlanesSquaresWhereTheyLie) {
  options_.views = 1;
  const ImageRgb8 image = Drawn(Rendered());
  // A plane is covered by squares of 16 blocks: their borders run along samples 16, 32, ...
  EXPECT_GT(InColumn(image, 16, 0), image.height() * 9 / 10);
  EXPECT_GT(InColumn(image, 32, 0), image.height() * 9 / 10);
  EXPECT_LT(InColumn(image, 24, 0), image.height() / 4);  // diagonals alone
}

TEST_F(WireframeTest, HidesWhatLiesBehindTheSurfaceAndWhereNothingIsSeen) {
  RenderResult result = Rendered();
  ASSERT_EQ(result.views_used.size(), 2U);
  const int middle = result.depth.width() / 2;
  for (int y = 0; y < result.depth.height(); ++y) {
    for (int x = 0; x < middle; ++x) result.depth(x, y) = y % 2 == 0 ? 8.0F : 0.0F;
  }
  const ImageRgb8 image = Drawn(result);
  int left = 0, right = 0;
  for (int x = 0; x < image.width(); ++x) {
    for (const int view : {0, 1}) (x < middle ? left : right) += InColumn(image, x, view);
  }
  EXPECT_EQ(left, 0);
  EXPECT_GT(right, 100);
}

TEST_F(WireframeTest, HasTheSameBytesForAnyNumberOfThreadsAndWhenMeshesAreKept) {
  const RenderResult result = Rendered();
  const ImageRgb8 one = OnThreads(1, [&] { return Drawn(result); });
  EXPECT_EQ(Drawn(result).data(), one.data());
  const ThreadLimit limit(3);
  EXPECT_EQ(Wireframe().Draw({result, scene_, novel_, options_, colours_}).data(), one.data());
}

TEST_F(WireframeTest, ShowsFullGridsForTheTwoPasses) {
  options_.views = 1;
  const RenderResult result = Rendered();
  // Squares of a plane stay, but where depth bends a little, tolerance no longer joins blocks.
  View& view = set_.frames[0].views[0];
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) view.depth(x, y) += 1e-4F * ((x * 7 + y * 3) % 5);
  }
  const auto lines = [&](const ImageRgb8& image) {
    int count = 0;
    for (int x = 0; x < image.width(); ++x) count += InColumn(image, x, 0);
    return count;
  };
  const int reduced = lines(Drawn(result));
  options_.method = RenderMethod::kTwoPass;
  EXPECT_GT(lines(Drawn(result)), 3 * reduced);
}

}  // namespace
}  // namespace dtr::viewer
