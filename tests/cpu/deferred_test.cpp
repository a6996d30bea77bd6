// SPEC 5 in the reference renderer.
#include <gtest/gtest.h>

#include "dtr/cpu/own_depth.h"
#include "dtr/cpu/renderer.h"
#include "dtr/render/frame.h"
#include "tests/cpu/render_testing.h"

namespace dtr::cpu {
namespace {

using namespace dtr::testing;

// f = 100: a pixel of disparity at a baseline of 1 is 0.01 of inverse depth.
constexpr double kPixelOfDisparity = 0.01;

/// One view of `surface` at the origin with a baseline of 1, and a novel camera beside it.
struct Pair {
  View view;
  ViewInNovel in_novel;
  PinholeCamera novel;

  Pair(const Surface& surface, const Eigen::Vector3d& novel_center)
      : view(Photograph(surface, Shot{})), novel(view.camera) {
    view.reference_baseline = 1;
    const ViewPlacement placed =
        PlaceView(view, Pose{Eigen::Quaterniond::Identity(), -novel_center});
    in_novel = {&view, placed.rotation, placed.translation, placed.near_z};
  }
  Pair(const Pair&) = delete;

  /// The fragment at pixel (x, y) from the start depth `start` (1/z).
  double Fragment(int x, int y, double start, const RenderOptions& options = {}) const {
    const Band band{novel.width_px(), 0, novel.height_px()};
    const auto pixel = static_cast<size_t>(y * novel.width_px() + x);
    std::vector<double> starts(static_cast<size_t>(novel.width_px() * novel.height_px()), 0.0);
    starts[pixel] = start;
    return FindOwnFragments(in_novel, novel, options, band, starts).inverse_depth[pixel];
  }
};

TEST(FindOwnFragments, RefinesAWrongStartToTheViewsOwnSurface) {
  // z = 10 + 0.3 x: w changes by 0.0003 per pixel, 0.03 px of disparity. From 0.5 to the right a
  // start wrong by 1 px of disparity is wrong by 0.5 px on the map; every step multiplies what is
  // left by 0.015.
  constexpr double kLeft = 5e-8;  // of 1/z; 0.01 * 0.015^3 = 3.4e-8, and float32 depth: 6e-9
  const Surface plane = Plane({-0.3, 0, 1}, 10);
  const Pair pair(plane, {0.5, 0, 0});
  for (const int x : {10, 40, 70}) {
    const double truth = 1 / plane({0.5, 0, 0}, pair.novel.RayFromPixel({x + 0.5, 30.5}));
    for (const double wrong_px : {-0.45, 0.0, 1.0}) {
      EXPECT_NEAR(pair.Fragment(x, 30, truth + wrong_px * kPixelOfDisparity), truth, kLeft)
          << x << " " << wrong_px;
    }
  }
}

TEST(FindOwnFragments, AnotherSurfaceAHoleAndWhatLiesOffTheMapGiveNone) {
  Pair pair(Plane({0, 0, 1}, 10), {0.5, 0, 0});
  const double w = 0.1;
  EXPECT_NEAR(pair.Fragment(40, 30, w), w, 1e-8);
  EXPECT_NEAR(pair.Fragment(40, 30, w + 1.9 * kPixelOfDisparity), w, 1e-8);
  EXPECT_EQ(pair.Fragment(40, 30, w + 2.1 * kPixelOfDisparity), 0);
  // A start behind the surface by more than the tolerance: that nearer surface was not drawn here.
  EXPECT_NEAR(pair.Fragment(40, 30, w - 0.4 * kPixelOfDisparity), w, 1e-8);
  EXPECT_EQ(pair.Fragment(40, 30, w - 0.6 * kPixelOfDisparity), 0);
  EXPECT_EQ(pair.Fragment(40, 30, 0), 0);
  // The plane lies 5 pixels to the right on the view's map, which ends at 96.
  EXPECT_GT(pair.Fragment(90, 30, w), 0);
  EXPECT_EQ(pair.Fragment(91, 30, w), 0);
  // All four samples around must exist for a mean; else the nearest says what there is.
  pair.view.depth(45, 30) = 0;
  EXPECT_EQ(pair.Fragment(40, 30, w), 0);
  EXPECT_NEAR(pair.Fragment(41, 30, w), w, 1e-8);
}

TEST(FindOwnFragments, FollowsSlopesSteeperThanTheDepthBreak) {
  // w changes by a pixel of disparity from column to column, twice the depth break: the nearest
  // sample alone would be off by up to half of that. A straight run is one surface (SPEC 2.3).
  constexpr double kLeft = 1e-7;  // float32 depth: 2^-24 of w, which is below 1
  Pair pair(Plane({0, 0, 1}, 10), {0.05, 0, 0});
  const auto truth_at = [](double column) { return 0.1 + kPixelOfDisparity * column; };
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) pair.view.depth(x, y) = static_cast<float>(1 / truth_at(x));
  }
  RenderOptions fine;
  fine.depth_break_px = 0.5;
  int found = 0;
  for (int x = 20; x < 80; ++x) {
    // The pixel's ray meets w = 0.1 + 0.01 u at u = x + 5 w, u from the first sample's centre.
    const double w = (0.1 + kPixelOfDisparity * x) / (1 - 5 * kPixelOfDisparity);
    const double fragment = pair.Fragment(x, 30, w, fine);
    EXPECT_NEAR(fragment, w, kLeft) << x;
    found += fragment > 0;
  }
  EXPECT_EQ(found, 60);
}

TEST(KeepSupportedSurfaces, PutsASurfaceWhereTheViewsPatchHasIt) {
  // As in RefinesAWrongStartToTheViewsOwnSurface: what is left of the start's error is 0.015 of it.
  // Twice the same view, for one alone decides.
  const Surface plane = Plane({-0.3, 0, 1}, 10);
  const Pair pair(plane, {0.5, 0, 0});
  const Band band{pair.novel.width_px(), 0, pair.novel.height_px()};
  const auto pixel = static_cast<size_t>(30 * band.width_px + 40);
  const double truth = 1 / plane({0.5, 0, 0}, pair.novel.RayFromPixel({40.5, 30.5}));
  size_t copies = 2;
  const auto held = [&](double wrong_px) {
    std::vector<double> surfaces(static_cast<size_t>(band.width_px * band.rows), 0.0);
    surfaces[pixel] = truth + wrong_px * kPixelOfDisparity;
    const std::vector<ViewInNovel> views(copies, pair.in_novel);
    KeepSupportedSurfaces(views, pair.novel, {}, BlendParametersOf({}, pair.novel.fx_px(), {}),
                          band, surfaces);
    return surfaces[pixel];
  };
  for (const double wrong_px : {-0.45, 0.0, 0.45, 1.9}) {
    EXPECT_NEAR(held(wrong_px), truth, 1e-8) << wrong_px;  // float32 depth
  }
  // Held by the view, but it lies more than half a pixel before the surface: that stays.
  EXPECT_EQ(held(-0.9), truth - 0.9 * kPixelOfDisparity);
  EXPECT_EQ(held(-1.1), truth - 1.1 * kPixelOfDisparity);  // no say at all
  EXPECT_NEAR(held(2.1), truth, 1e-8);  // seen through: the view's own takes its place
  copies = 1;
  for (const double wrong_px : {-3.0, -1.1, -0.9, 1.0, 2.1}) {
    EXPECT_NEAR(held(wrong_px), truth, 1e-8) << wrong_px;
  }
}

TEST(FindOwnFragments, DepthIsNeverMixedAcrossABreak) {
  // A square at z = 5 before a plane at z = 10; the novel camera stands so that the outline falls
  // between two of its pixel centres.
  const Pair pair(SquareAndPlane(), {0.13, 0.06, 0});
  for (const double start : {0.1, 0.2}) {
    for (int x = 0; x < 96; ++x) {
      const double w = pair.Fragment(x, 36, start);
      EXPECT_TRUE(w == 0 || std::abs(w - start) < 1e-7) << x << " " << w;
    }
  }
}

TEST(Deferred, AnInputCameraAloneGivesItsOwnImageBack) {
  const DtrSet set = SquareBeforePlane();
  RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  options.views = 1;
  const View& view = set.frames[0].views[1];
  const RenderResult result =
      Render(MakeRenderScene(set), view.camera, view.cam_from_world, options);
  EXPECT_EQ(result.coverage_share, 1);
  EXPECT_LE(LargestDifference(result.image, view.image), 1);
}

TEST(Deferred, PrimitiveAndPointSizeSayNothing) {
  const DtrSet set = SquareBeforePlane();
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 10});
  RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  const RenderResult mesh =
      Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
  options.primitive = Primitive::kSplat;
  options.point_size = 3;
  ExpectSameBytes(mesh, Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options));
}

TEST(Deferred, IsTheTwoPassPictureWhereSurfacesAreFlat) {
  const DtrSet set =
      SetOf({Photograph(Plane({0.3, 0, 1}, 9), ShotFrom("a", {0, 0, 0}, {0, 0, 9})),
             Photograph(Plane({0.3, 0, 1}, 9), ShotFrom("b", {1, 0, 0}, {0, 0, 9}))});
  const Shot novel = ShotFrom("n", {0.4, 0.2, 0.5}, {0, 0, 9});
  const RenderScene scene = MakeRenderScene(set);
  const RenderResult a = Render(scene, novel.camera, novel.cam_from_world, {});
  const RenderResult b =
      Render(scene, novel.camera, novel.cam_from_world, OptionsOf(RenderMethod::kDeferred));
  int both = 0, coverage_apart = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      coverage_apart += a.coverage(x, y) != b.coverage(x, y);
      if (a.coverage(x, y) == 0 || b.coverage(x, y) == 0) continue;
      // At the rim of a photo the half pixel beyond the outermost centres continues the surface in
      // one method and repeats its last value in the other.
      if (a.view_count(x, y) != 2 || b.view_count(x, y) != 2) continue;
      ++both;
      EXPECT_LE(PixelDifference(a.image, b.image, x, y), 2) << x << " " << y;
    }
  }
  EXPECT_GT(both, 4000);
  EXPECT_LE(coverage_apart, 96);
}

/// Views 0.5 apart before the plane z = 10; `wrong` has a patch at z = 5 that is not there, right
/// before the novel camera at the origin.
RenderScene WithAPatchInTheAir(const std::string& wrong, const std::vector<double>& centers_x,
                               DtrSet& set) {
  std::vector<View> views;
  for (size_t i = 0; i < centers_x.size(); ++i) {
    const Shot shot = ShotFrom("v" + std::to_string(i), {centers_x[i], 0, 0}, {0, 0, 10});
    views.push_back(Photograph(shot.id == wrong ? SquareAndPlane() : Plane({0, 0, 1}, 10), shot));
  }
  set = SetOf(std::move(views));
  return MakeRenderScene(set);
}

TEST(HeldSurfaces, APatchThatOneFarViewClaimsHidesNothing) {
  DtrSet set;
  const RenderScene scene = WithAPatchInTheAir("v3", {-0.5, 0.25, 0.5, 1}, set);
  const Shot novel = ShotFrom("n", {0, 0, 0}, {0, 0, 10});
  const auto at_the_middle = [&](RenderMethod method) {
    return Render(scene, novel.camera, novel.cam_from_world, OptionsOf(method));
  };
  EXPECT_NEAR(at_the_middle(RenderMethod::kTwoPass).depth(48, 36), 5, 1e-4);
  const RenderResult held = at_the_middle(RenderMethod::kDeferred);
  EXPECT_NEAR(held.depth(48, 36), 10, 1e-4);
  EXPECT_EQ(held.view_count(48, 36), 3);  // the fourth looks at its patch
}

TEST(HeldSurfaces, TheNearestViewIsBelievedAgainstAFarOne) {
  DtrSet set;
  const RenderScene scene = WithAPatchInTheAir("v0", {0.1, 1}, set);
  const Shot novel = ShotFrom("n", {0, 0, 0}, {0, 0, 10});
  const RenderResult result =
      Render(scene, novel.camera, novel.cam_from_world, OptionsOf(RenderMethod::kDeferred));
  EXPECT_NEAR(result.depth(48, 36), 5, 1e-4);
}

TEST(HeldSurfaces, AHoleSaysAQuarterOfADepth) {
  // A view 0.5 to one side, and others at the same angle that have no depth there: each of their
  // says is a quarter of its say.
  for (const int holes : {3, 5}) {
    std::vector<View> views = {
        Photograph(Plane({0, 0, 1}, 10), ShotFrom("a", {0.5, 0, 0}, {0, 0, 10}))};
    for (int i = 0; i < holes; ++i) {
      const double turn = 1 + i;  // radians
      views.push_back(
          Photograph(Plane({0, 0, 1}, 10),
                     ShotFrom("h" + std::to_string(i),
                              {0.5 * std::cos(turn), 0.5 * std::sin(turn), 0}, {0, 0, 10})));
    }
    DtrSet set = SetOf(std::move(views));
    for (View& view : set.frames[0].views) {
      if (view.id == "a") continue;
      for (int y = 0; y < 72; ++y) {
        for (int x = y == 0 ? 1 : 0; x < 96; ++x) view.depth(x, y) = 0;  // it looked: one is left
      }
    }
    const Shot novel = ShotFrom("n", {0, 0, 0}, {0, 0, 10});
    const RenderResult result = Render(MakeRenderScene(set), novel.camera, novel.cam_from_world,
                                       OptionsOf(RenderMethod::kDeferred));
    EXPECT_EQ(result.coverage(52, 36) != 0, holes == 3) << holes;
  }
}

TEST(HeldSurfaces, WhatIsMaskedSaysNothing) {
  // The view at the novel camera's own place outweighs all others: its hole hides what they hold.
  DtrSet set;
  WithAPatchInTheAir("none", {0.0, 0.5, 1}, set);
  const Shot novel = ShotFrom("n", {0, 0, 0}, {0, 0, 10});
  const auto picture = [&] {
    return Render(MakeRenderScene(set), novel.camera, novel.cam_from_world,
                  OptionsOf(RenderMethod::kDeferred));
  };
  View& nearest = set.frames[0].views[0];
  const float corner = nearest.depth(0, 0);
  for (float& z : nearest.depth.grid().data()) z = 0;
  // A view that stereo found nothing of, or never looked at, has no say.
  EXPECT_NEAR(picture().depth(48, 36), 10, 1e-4);
  nearest.depth(0, 0) = corner;
  EXPECT_EQ(picture().coverage(48, 36), 0);
  nearest.mask = Mask(nearest.camera.width_px(), nearest.camera.height_px());
  const RenderResult masked = picture();
  EXPECT_NEAR(masked.depth(48, 36), 10, 1e-4);
  // What a masked view would weigh is the others': the image is that of the set without it.
  const std::vector<std::string> without = {nearest.id};
  ExpectSameBytes(masked, Render(MakeRenderScene(set, without), novel.camera, novel.cam_from_world,
                                 OptionsOf(RenderMethod::kDeferred)));
  // Masked samples beside others: these still say what they say.
  nearest.mask(48, 36) = nearest.mask(0, 0) = 255;
  EXPECT_EQ(picture().coverage(48, 36), 0);
}

}  // namespace
}  // namespace dtr::cpu
