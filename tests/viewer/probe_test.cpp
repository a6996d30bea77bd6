#include "viewer/probe.h"

#include <gtest/gtest.h>

#include <set>

#include "datasets/exact/analytic_scene.h"
#include "dtr/cpu/contributions.h"
#include "dtr/cpu/renderer.h"
#include "viewer/navigation.h"
#include "viewer/shown.h"

namespace dtr::viewer {
namespace {

using testing::Photograph;
using testing::Plane;
using testing::Shot;

constexpr double kSigma = 2e-4;  // of inverse depth, 1 / scene units

/// Three views of a plane at z = 10.
class ProbeTest : public ::testing::Test {
 protected:
  ProbeTest() {
    set_.frames.resize(1);
    for (const double x : {-1.0, 0.0, 1.2}) {
      Shot shot;
      shot.id = "v" + std::to_string(set_.frames[0].views.size());
      shot.cam_from_world = testing::LookAt({x, 0, 0}, {0, 0, 10});
      View view = Photograph(Plane({0, 0, 1}, 10), shot);
      view.reference_baseline = 1;
      view.inverse_depth_sigma = Grid<float>(96, 72, 1, static_cast<float>(kSigma));
      set_.frames[0].views.push_back(view);
    }
    set_.scene_center = {0, 0, 10};
    scene_ = MakeRenderScene(set_);
    novel_ = {{96, 72, 100, 100, 48, 36}, testing::LookAt({0.3, 0.1, 0}, {0, 0, 10})};
    result_ = cpu::Render(scene_, novel_.camera, novel_.cam_from_world, options_);
  }
  static const Grid<float>* SigmaOfView(const View& view) { return &*view.inverse_depth_sigma; }
  Probe At(int x, int y) const {
    return ProbePixel(scene_, novel_, options_, x, y, result_.depth(x, y), SigmaOfView);
  }

  DtrSet set_;
  RenderScene scene_;
  NovelCamera novel_;
  RenderOptions options_;
  RenderResult result_;
};

TEST_F(ProbeTest, KnowsThePointAndWhatEachViewSaysOfIt) {
  const Probe probe = At(50, 30);
  EXPECT_NEAR(probe.p_in_world.z(), 10, 1e-4);
  ASSERT_EQ(probe.views.size(), 3u);
  EXPECT_EQ(probe.views[0].name, "v1");  // the nearest by angle
  double sum = 0;
  for (const ProbeView& view : probe.views) {
    sum += view.share;
    EXPECT_NEAR(view.behind_px, 0, 1e-3);
    ASSERT_TRUE(view.sigma_z);
    EXPECT_NEAR(*view.sigma_z, kSigma * view.depth_z * view.depth_z, 1e-6);
  }
  EXPECT_NEAR(sum, 1, 1e-6);
  EXPECT_NEAR(*probe.sigma_z, kSigma * 100, 1e-3);
}

TEST_F(ProbeTest, SharesOfAPixelAreThoseOfThePicture) {
  const cpu::Contributions whole =
      cpu::ContributionsTo(result_.depth, scene_, novel_.camera, novel_.cam_from_world, options_);
  for (const auto& [x, y] : {std::pair(10, 10), {50, 30}, {80, 60}}) {
    double seen = 0;
    for (const ProbeView& view : At(x, y).views) {
      for (size_t i = 0; i < whole.views.size(); ++i) {
        if (scene_.views[static_cast<size_t>(whole.views[i])]->name != view.name) continue;
        EXPECT_NEAR(whole.shares[i](x, y), view.share, 1e-5);
        seen += view.share;
      }
    }
    EXPECT_NEAR(seen, 1, 1e-5);
  }
}

TEST_F(ProbeTest, SharesTimesColoursAreTheRenderersColours) {
  // Black and white views: the image's grey is the white ones' share.
  for (size_t i = 0; i < 3; ++i) {
    View& view = set_.frames[0].views[i];
    view.image = ImageRgb8(96, 72, 3, i == 1 ? 255 : 0);
  }
  const RenderResult drawn = cpu::Render(scene_, novel_.camera, novel_.cam_from_world, options_);
  const cpu::Contributions found =
      cpu::ContributionsTo(drawn.depth, scene_, novel_.camera, novel_.cam_from_world, options_);
  int compared = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      if (drawn.coverage(x, y) == 0) continue;
      for (size_t i = 0; i < found.views.size(); ++i) {
        if (found.views[i] != 1) continue;
        EXPECT_NEAR(255 * found.shares[i](x, y), drawn.image(x, y), 1);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 5000);
}

TEST_F(ProbeTest, ADistanceHasTheUncertaintyOfItsEnds) {
  const Probe a = At(30, 36), b = At(70, 36);
  const Distance across = DistanceBetween(a, b);
  EXPECT_NEAR(across.length, (a.p_in_world - b.p_in_world).norm(), 1e-12);
  ASSERT_TRUE(across.sigma);
  // Nearly across the rays: little more than what the pixels leave open, 2 x (z / fx)^2 / 12.
  EXPECT_NEAR(*across.sigma, std::sqrt(2.0 / 12) * 10 / 100, 0.01);
  // Along a ray sigma itself decides.
  Probe behind = a;
  const Eigen::Vector3d away =
      (a.p_in_world - novel_.cam_from_world.TargetOriginInSource()).normalized();
  behind.p_in_world += 3 * away;
  const Distance along = DistanceBetween(a, behind);
  EXPECT_NEAR(along.length, 3, 1e-9);
  EXPECT_NEAR(*along.sigma, std::sqrt(2.0) * kSigma * 100, 0.004);
  behind.has_covariance = false;
  EXPECT_FALSE(DistanceBetween(a, behind).sigma);
}

TEST(CovarianceOf, IsSigmaAlongTheRayAndPixelsAcross) {
  const NovelCamera camera{{100, 100, 200, 400, 50, 50}, Pose{}};
  const Eigen::Matrix3d covariance = CovarianceOf({0, 0, 8}, camera, 0.5);
  const Eigen::Vector3d expected(8.0 * 8 / (200.0 * 200) / 12, 8.0 * 8 / (400.0 * 400) / 12, 0.25);
  EXPECT_LT((covariance - Eigen::Matrix3d(expected.asDiagonal())).norm(), 1e-12);
}

TEST_F(ProbeTest, AViewKeepsItsColourWhateverElseIsLeftOut) {
  const ViewColours colours(set_);
  const View& last = set_.frames[0].views[2];
  RenderScene alone = scene_;
  alone.views = {&last};  // the first of this scene, the third of the set
  const RenderResult result = cpu::Render(alone, novel_.camera, novel_.cam_from_world, options_);
  const ImageRgb8 picture =
      FalseColour(Shown::kWeights, {result, alone, novel_, options_, colours}, SigmaOfView).image;
  const Rgb colour = colours.Of(last);
  EXPECT_NE(colour, colours.Of(set_.frames[0].views[0]));
  ASSERT_NE(result.coverage(48, 36), 0);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(picture(48, 36, c), colour[static_cast<size_t>(c)]);
}

TEST_F(ProbeTest, FalseColoursTellSeenFromUnseen) {
  View& view = set_.frames[0].views[0];
  view.depth = DepthImage(96, 72);
  const RenderResult result = cpu::Render(scene_, novel_.camera, novel_.cam_from_world, options_);
  const ViewColours colours(set_);
  const Drawn drawn{result, scene_, novel_, options_, colours};
  for (const Shown shown : kAllShown) {
    if (shown == Shown::kColour || shown == Shown::kWireframe) continue;
    const ImageRgb8 picture = FalseColour(shown, drawn, SigmaOfView).image;
    ASSERT_EQ(picture.width(), 96);
    std::set<std::array<std::uint8_t, 3>> found;
    for (int y = 0; y < 72; ++y) {
      for (int x = 0; x < 96; ++x) {
        found.insert({picture(x, y, 0), picture(x, y, 1), picture(x, y, 2)});
      }
    }
    EXPECT_FALSE(found.empty()) << NameOf(shown);
    if (shown == Shown::kWeights) {
      // The view without depth gives nothing.
      EXPECT_GT(found.size(), 1u);
    }
  }
}

}  // namespace
}  // namespace dtr::viewer
