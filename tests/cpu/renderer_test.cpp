#include "dtr/cpu/renderer.h"

#include <gtest/gtest.h>

#include "dtr/base/error.h"
#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"
#include "dtr/render/fill_holes.h"
#include "dtr/render/geometry.h"
#include "tests/cpu/render_testing.h"
#include "tests/support/on_threads.h"

namespace dtr::cpu {
namespace {

using namespace dtr::testing;

// Relative; vertices are snapped to 1/2048 px, and this plane's depth changes by 1 % per pixel.
constexpr double kSnappedDepth = 1e-5;

TEST(Render, AnInputCameraAloneGivesItsOwnImageBack) {
  for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
    const DtrSet set = SquareBeforePlane();
    RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
    options.views = 1;
    options.primitive = primitive;
    const View& view = set.frames[0].views[1];
    const RenderResult result =
        Render(MakeRenderScene(set), view.camera, view.cam_from_world, options);
    EXPECT_EQ(result.coverage_share, 1);
    EXPECT_EQ(result.views_used, std::vector<int>{1});
    // Coordinates pass through two rotations; the pixel found again is off by 1e-13 of itself.
    EXPECT_LE(LargestDifference(result.image, view.image), 1);
    for (int y = 0; y < view.depth.height(); ++y) {
      for (int x = 0; x < view.depth.width(); ++x) {
        EXPECT_NEAR(result.depth(x, y), view.depth(x, y), 1e-6 * view.depth(x, y));
      }
    }
  }
}

TEST(Render, FrontoParallelPlaneFromAShiftedCameraHasTheClosedForm) {
  // f = 100 at z = 10: a step of 0.5 to the right moves the plane 5 pixels to the left.
  const DtrSet set = SetOf({Photograph(Plane({0, 0, 1}, 10), Shot{})});
  const View& view = set.frames[0].views[0];
  const Pose shifted{Eigen::Quaterniond::Identity(), {-0.5, 0, 0}};
  const RenderResult result = Render(MakeRenderScene(set), view.camera, shifted, {});
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      ASSERT_EQ(result.coverage(x, y) != 0, x + 5 < 96) << x << " " << y;
      if (x + 5 >= 96) continue;
      EXPECT_NEAR(result.depth(x, y), 10, 1e-5);
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(result.image(x, y, c), view.image(x + 5, y, c), 1) << x << " " << y;
      }
    }
  }
}

TEST(Render, ASlantedPlaneSeenFromAsideMatchesItsTexture) {
  const Surface plane = Plane({0.6, 0, 0.8}, 8);
  const DtrSet set = SetOf({Photograph(plane, ShotFrom("a", {0, 0, 0}, {0, 0, 10})),
                            Photograph(plane, ShotFrom("b", {2, 0, 0}, {0, 0, 10}))});
  const Shot novel = ShotFrom("n", {1, 0.3, 0}, {0, 0, 10});
  const View truth = Photograph(plane, novel);
  for (const int scale : {1, 2}) {
    DtrSet scaled = set;
    for (View& view : scaled.frames[0].views) {
      Shot shot{view.id, view.camera, view.cam_from_world, scale};
      view = Photograph(plane, shot);
    }
    FinishGeometry(scaled);
    const RenderResult result = Render(MakeRenderScene(scaled), novel.camera, novel.cam_from_world,
                                       OptionsOf(RenderMethod::kTwoPass));
    EXPECT_GT(result.coverage_share, 0.85);
    int beyond = 0;
    for (int y = 0; y < 72; ++y) {
      for (int x = 0; x < 96; ++x) {
        if (result.coverage(x, y) == 0) continue;
        EXPECT_NEAR(result.depth(x, y), truth.depth(x, y), kSnappedDepth * truth.depth(x, y));
        // Bilinear interpolation of a texture with a period of 40 pixels errs by 0.5 level, the
        // two roundings by another; beyond the outermost pixel centres of a photo its last colour
        // goes on for half a pixel, where the texture changes by up to 5 levels.
        const int difference = PixelDifference(result.image, truth.image, x, y);
        ASSERT_LE(difference, 5) << x << " " << y;
        beyond += difference > 2;
      }
    }
    EXPECT_LE(beyond, 2 * (96 + 72));  // the rims of two photos
  }
}

TEST(Render, TheOrderOfTheViewsChangesNothing) {
  const DtrSet set = SquareBeforePlane();
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 10});
  RenderScene scene = MakeRenderScene(set);
  for (const RenderMethod method : kBothMethods) {
    for (const BlendWeight blend : kAllWeights) {
      RenderOptions options = OptionsOf(method);
      options.blend = blend;
      options.views = 3;
      const RenderResult forward = Render(scene, novel.camera, novel.cam_from_world, options);
      RenderScene reversed = scene;
      std::reverse(reversed.views.begin(), reversed.views.end());
      const RenderResult backward = Render(reversed, novel.camera, novel.cam_from_world, options);
      ExpectSameBytes(forward, backward);
    }
  }
}

TEST(Render, ThreadsChangeNothing) {
  const DtrSet set = SquareBeforePlane();
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 10});
  const RenderScene scene = MakeRenderScene(set);
  for (const RenderMethod method : kBothMethods) {
    const auto draw = [&] {
      return Render(scene, novel.camera, novel.cam_from_world, OptionsOf(method));
    };
    ExpectSameBytes(OnThreads(1, draw), OnThreads(3, draw));
  }
}

TEST(Render, ADuplicatedViewChangesNothing) {
  DtrSet set = SquareBeforePlane();
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 10});
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
  options.views = 2;
  const RenderResult before =
      Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
  for (int i = 0; i < 5; ++i) {
    View copy = set.frames[0].views[1];
    copy.id = copy.name = "copy" + std::to_string(i);
    set.frames[0].views.push_back(copy);
  }
  ExpectSameBytes(before,
                  Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options));
}

TEST(Render, ThePictureDoesNotDependOnTheScaleOfTheWorld) {
  const DtrSet set = SquareBeforePlane();
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 10});
  for (const RenderMethod method : kBothMethods) {
    const RenderOptions options = OptionsOf(method);
    const RenderResult expected =
        Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
    for (const double scale : {1e-3, 0.1, 7.0, 1e3}) {
      DtrSet scaled = set;
      for (View& view : scaled.frames[0].views) {
        view.cam_from_world.translation *= scale;
        for (float& z : view.depth.grid().data()) z = static_cast<float>(z * scale);
      }
      FinishGeometry(scaled);
      Pose pose = novel.cam_from_world;
      pose.translation *= scale;
      const RenderResult result = Render(MakeRenderScene(scaled), novel.camera, pose, options);
      EXPECT_EQ(result.coverage.data(), expected.coverage.data()) << scale;
      EXPECT_LE(LargestDifference(result.image, expected.image), 1) << scale;
    }
  }
}

TEST(Render, ThePictureDoesNotDependOnWhereTheWorldIs) {
  const DtrSet set = SquareBeforePlane();
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 10});
  const Eigen::Vector3d offset(1e7, -1e7, 1e7);
  const auto moved = [&](const Pose& pose) {
    return Pose{pose.rotation, pose.translation - pose.rotation * offset};
  };
  DtrSet far = set;
  for (View& view : far.frames[0].views) view.cam_from_world = moved(view.cam_from_world);
  FinishGeometry(far);
  for (const RenderMethod method : kBothMethods) {
    const RenderOptions options = OptionsOf(method);
    const RenderResult expected =
        Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
    const RenderResult result =
        Render(MakeRenderScene(far), novel.camera, moved(novel.cam_from_world), options);
    EXPECT_EQ(result.coverage.data(), expected.coverage.data());
    EXPECT_LE(LargestDifference(result.image, expected.image), 1);
  }
}

TEST(Render, ADepthBreakLeavesAHoleAndNoRubberSheet) {
  // One view: a square at z = 5 hides a strip of the plane at z = 10 from a camera to the side.
  DtrSet set = SquareBeforePlane();
  set.frames[0].views.resize(1);
  FinishGeometry(set);
  const Shot novel = ShotFrom("n", {1, 0, 0}, {0, 0, 10});
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
  const RenderResult broken =
      Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
  // Every depth shown lies on one of the two surfaces; a sheet would have depths between them.
  const View truth = Photograph(SquareAndPlane(), novel);
  const auto between = [&](const RenderResult& result) {
    int count = 0;
    for (int y = 0; y < 72; ++y) {
      for (int x = 0; x < 96; ++x) {
        if (result.coverage(x, y) == 0) continue;
        const float z = result.depth(x, y);
        count += z > 6 && z < 9;
      }
    }
    return count;
  };
  EXPECT_EQ(between(broken), 0);
  EXPECT_LT(broken.coverage_share, 0.97);
  options.depth_break_px = 1e9;
  const RenderResult sheet =
      Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
  EXPECT_GT(between(sheet), 20);
  options.absolute_depth_break = 3.5;  // the report's, by name
  EXPECT_EQ(between(Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options)), 0);
}

TEST(Render, DeltaDecidesWhatIsBlended) {
  // Two views, the second one's plane 0.1 nearer: 100 * 1 * (1/9.9 - 1/10) = 0.101 px of disparity.
  View near = Photograph(Plane({0, 0, 1}, 9.9), ShotFrom("near", {0.5, 0, 0}, {0.5, 0, 10}));
  View far = Photograph(Plane({0, 0, 1}, 10), ShotFrom("far", {-0.5, 0, 0}, {-0.5, 0, 10}));
  DtrSet set = SetOf({near, far});
  for (View& view : set.frames[0].views) view.reference_baseline = 1;
  const Shot novel = ShotFrom("n", {0, 0, 0}, {0, 0, 10});
  const RenderScene scene = MakeRenderScene(set);
  const auto render = [&](double delta_px, std::optional<double> absolute = {}) {
    RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
    options.delta_px = delta_px;
    options.absolute_delta = absolute;
    return Render(scene, novel.camera, novel.cam_from_world, options);
  };
  const double disparity = 100 * (1 / 9.9 - 1 / 10.0);
  EXPECT_EQ(render(1.01 * disparity).view_count(48, 36), 2);
  EXPECT_EQ(render(0.99 * disparity).view_count(48, 36), 1);
  EXPECT_EQ(render(0).view_count(48, 36), 1);
  EXPECT_NEAR(render(0).depth(48, 36), 9.9, 1e-5);
  EXPECT_EQ(render(0, 0.11).view_count(48, 36), 2);
  EXPECT_EQ(render(99, 0.09).view_count(48, 36), 1);
  // Only fragments at the border of Delta are marked; pushing depth moves nothing on the screen.
  EXPECT_EQ(render(1.01 * disparity).delta_border(48, 36), 0);
  EXPECT_EQ(render(disparity).delta_border(48, 36), 255);
  EXPECT_EQ(render(0.99 * disparity).coverage.data(), render(50).coverage.data());
}

// Two photos of one wall, the second exposed by (1, 2, 0.5) against the first, with the gains that
// bring both to their mean.
DtrSet TwoExposures() {
  DtrSet set = SetOf({Photograph(Plane({0, 0, 1}, 10), Shot{}),
                      Photograph(Plane({0, 0, 1}, 10), ShotFrom("w", {2, 0, 0}, {2, 0, 10}))});
  const Eigen::Vector3d apart(1, 2, 0.5);
  for (int k = 0; k < 2; ++k) {
    View& view = set.frames[0].views[static_cast<size_t>(k)];
    for (size_t i = 0; i < view.image.data().size(); ++i) {
      const double exposure = k == 0 ? 1 : apart[static_cast<Eigen::Index>(i % 3)];
      view.image.data()[i] = Srgb8FromLinear(Exposed(LinearFromSrgb8()[100], exposure));
    }
    view.gain = apart.array().pow(k == 0 ? 0.5 : -0.5);
  }
  return set;
}

TEST(Render, AtAnInputCameraTheImageIsExposedAsItsPhoto) {
  const DtrSet set = TwoExposures();
  for (const View& view : set.frames[0].views) {
    for (const RenderMethod method : {RenderMethod::kTwoPass, RenderMethod::kDeferred}) {
      for (const bool linear : {true, false}) {
        RenderOptions options = OptionsOf(method);
        options.blend_in_linear_light = linear;
        const RenderResult result =
            Render(MakeRenderScene(set), view.camera, view.cam_from_world, options);
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(result.image(40, 40, c), view.image(40, 40, c), 1) << view.id;
        }
      }
    }
  }
}

TEST(Render, BetweenTwoInputCamerasItIsExposedBetweenThem) {
  const DtrSet set = TwoExposures();
  const auto& views = set.frames[0].views;
  Pose between = views[0].cam_from_world;
  between.translation =
      -(between.rotation * (0.5 * (views[0].CenterInWorld() + views[1].CenterInWorld())));
  const RenderResult result =
      Render(MakeRenderScene(set), views[0].camera, between, OptionsOf(RenderMethod::kTwoPass));
  for (int c = 0; c < 3; ++c) {
    const double exposure = std::sqrt(Eigen::Vector3d(1, 2, 0.5)[c]);
    EXPECT_NEAR(result.image(40, 40, c), Srgb8FromLinear(Exposed(LinearFromSrgb8()[100], exposure)),
                1);
  }
}

// Three photos of a bright wall, the middle one 2.2 times as bright in linear light, and so clipped
// as a sensor does it; and the gains that bring all to their mean.
constexpr double kWallLight = 0.5, kBrighter = 2.2;

DtrSet ClippedBetweenOthers() {
  std::vector<View> views;
  for (int k = 0; k < 3; ++k) {
    views.push_back(Photograph(Plane({0, 0, 1}, 10), ShotFrom("v" + std::to_string(k),
                                                              {k - 1.0, 0, 0}, {k - 1.0, 0, 10})));
    View& view = views.back();
    const double exposure = k == 1 ? kBrighter : 1;
    std::fill(view.image.data().begin(), view.image.data().end(),
              Srgb8FromLinear(std::min(1.0, exposure * kWallLight)));
    view.gain.setConstant(std::cbrt(kBrighter) / exposure);
  }
  return SetOf(std::move(views));
}

// What the wall is in the exposure of a frame.
int WallIn(const RenderScene& scene, const RenderOptions& options, const Pose& cam_from_world) {
  const Eigen::Vector3d frame =
      FrameExposure(scene, SelectViews(scene, cam_from_world, options), cam_from_world);
  return Srgb8FromLinear(Exposed(Exposed(kWallLight, std::cbrt(kBrighter)), frame[0]));
}

TEST(Render, WhatAPhotoClippedIsNoColourWhereAnotherMeasuredOne) {
  const DtrSet set = ClippedBetweenOthers();
  const RenderScene scene = MakeRenderScene(set);
  const Shot novel = ShotFrom("n", {0.9, 0.3, 0}, {0.9, 0.3, 10});  // nearest to one that is not
  for (const RenderMethod method : {RenderMethod::kTwoPass, RenderMethod::kDeferred}) {
    for (const bool linear : {true, false}) {
      RenderOptions options = OptionsOf(method);
      options.blend_in_linear_light = linear;
      const RenderResult result = Render(scene, novel.camera, novel.cam_from_world, options);
      const int wall = WallIn(scene, options, novel.cam_from_world);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(result.image(48, 36, c), wall, 2);
    }
  }
  // From its own position the clipped photo is shown as it is.
  const View& clipped = set.frames[0].views[1];
  const RenderResult own =
      Render(scene, clipped.camera, clipped.cam_from_world, OptionsOf(RenderMethod::kDeferred));
  EXPECT_GE(own.image(48, 36, 0), 253);
}

TEST(Render, WhatAPhotoClippedIsShownWhereNoOtherSeesAnything) {
  DtrSet set = ClippedBetweenOthers();
  for (const size_t k : {0u, 2u}) set.frames[0].views[k].mask = Mask(96, 72, 1, 0);
  const Shot novel = ShotFrom("n", {0.2, 0.3, 0}, {0.2, 0.3, 10});
  const RenderResult result = Render(MakeRenderScene(set), novel.camera, novel.cam_from_world,
                                     OptionsOf(RenderMethod::kDeferred));
  EXPECT_EQ(result.coverage(48, 36), 255);
  EXPECT_EQ(result.image(48, 36, 1), 255);
}

TEST(Render, MaskedPixelsAreNeitherShownNorInTheWay) {
  DtrSet set = SquareBeforePlane();
  View& view = set.frames[0].views[0];
  view.mask = Mask(96, 72, 1, 255);
  for (int y = 20; y < 40; ++y) {
    for (int x = 30; x < 50; ++x) view.mask(x, y) = 0;
  }
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
  options.views = 1;
  const RenderResult result =
      Render(MakeRenderScene(set), view.camera, view.cam_from_world, options);
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) EXPECT_EQ(result.coverage(x, y), view.mask(x, y));
  }
}

TEST(Render, SmoothsEdgesOfTheFinishedImageAlone) {
  const DtrSet set = SquareBeforePlane();
  const RenderScene views = MakeRenderScene(set);
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 8});
  const auto render = [&](const RenderOptions& options) {
    return Render(views, novel.camera, novel.cam_from_world, options);
  };
  RenderOptions options = OptionsOf(RenderMethod::kDeferred);
  for (const bool fill : {false, true}) {
    options.fill_holes = fill;
    options.smooth_edges = false;
    const RenderResult with_stairs = render(options);
    options.smooth_edges = true;
    RenderResult smoothed = render(options);
    ExpectSameBytes(render(options), smoothed);
    EXPECT_NE(smoothed.image, with_stairs.image);
    smoothed.image = with_stairs.image;
    ExpectSameBytes(smoothed, with_stairs);
  }
}

TEST(Render, FillsTheFinishedImageAndCountsNothingOfItAsSeen) {
  // A square before nothing, photographed in different exposures.
  std::vector<View> views;
  for (int i = 0; i < 3; ++i) {
    views.push_back(Photograph(
        Square(0, 0, 8, 2), ShotFrom("v" + std::to_string(i), {0.4 * (i - 1), 0, 0}, {0, 0, 8})));
    views.back().gain.setConstant(1 + 0.2 * i);
  }
  const DtrSet set = SetOf(std::move(views));
  const RenderScene scene = MakeRenderScene(set);
  const Shot novel = ShotFrom("n", {0.2, 0.1, 0}, {0, 0, 8});
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
  const RenderResult bare = Render(scene, novel.camera, novel.cam_from_world, options);
  RenderResult expected = bare;
  FillHoles(expected);
  options.fill_holes = true;
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    const RenderResult filled = Render(scene, novel.camera, novel.cam_from_world, options);
    ExpectSameBytes(filled, expected);
    EXPECT_EQ(filled.coverage, bare.coverage);
    EXPECT_EQ(filled.depth, bare.depth);
    EXPECT_EQ(filled.view_count, bare.view_count);
    EXPECT_EQ(filled.coverage_share, bare.coverage_share);
  }
  int holes = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      if (bare.coverage(x, y) != 0) continue;
      ++holes;
      EXPECT_GT(expected.image(x, y, 0) + expected.image(x, y, 1) + expected.image(x, y, 2), 0);
    }
  }
  EXPECT_GT(holes, 3000);
}

}  // namespace
}  // namespace dtr::cpu
