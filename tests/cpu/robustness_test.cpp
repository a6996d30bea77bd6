#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "dtr/cpu/renderer.h"
#include "dtr/render/scene.h"
#include "dtr/render/valid_views.h"
#include "tests/cpu/render_testing.h"

namespace dtr::cpu {
namespace {

using namespace dtr::testing;

bool Empty(const RenderResult& result) {
  const auto& covered = result.coverage.data();
  return std::count(covered.begin(), covered.end(), 0) ==
         static_cast<std::ptrdiff_t>(covered.size());
}

TEST(Render, NoValidViewGivesAnEmptyPicture) {
  const DtrSet set = SquareBeforePlane();
  const Shot behind = ShotFrom("n", {0, 0, 30}, {0, 0, 10});
  const RenderResult result =
      Render(MakeRenderScene(set), behind.camera, behind.cam_from_world, {});
  EXPECT_TRUE(Empty(result));
  EXPECT_TRUE(result.views_used.empty());
  EXPECT_EQ(result.coverage_share, 0);
  ExpectSound(result);
  RenderOptions filled = OptionsOf(RenderMethod::kTwoPass);
  filled.fill_holes = true;
  ExpectSound(Render(MakeRenderScene(set), behind.camera, behind.cam_from_world, filled));
  ExpectSound(Render(RenderScene{}, behind.camera, behind.cam_from_world, {}));
}

TEST(Render, TheBackOfASurfaceIsNotShown) {
  const DtrSet set = SquareBeforePlane();
  for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
    RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
    options.primitive = primitive;
    options.max_angle_rad = std::numbers::pi;
    const Shot behind = ShotFrom("n", {0, 0, 30}, {0, 0, 10});
    EXPECT_TRUE(Empty(Render(MakeRenderScene(set), behind.camera, behind.cam_from_world, options)));
  }
}

TEST(Render, ACameraInsideTheGeometryCutsWhatIsBehindIt) {
  // On the plane's far slope: the floor y = 1 runs under the camera and behind it.
  const Surface floor = Plane({0, 1, 0}, 1);
  const DtrSet set = SetOf({Photograph(floor, ShotFrom("a", {0, 0, -3}, {0, 0.5, 5})),
                            Photograph(floor, ShotFrom("b", {0.5, 0, -3}, {0, 0.5, 5}))});
  const Shot novel = ShotFrom("n", {0, 0.6, 1}, {0, 0.9, 6});
  const View truth = Photograph(floor, novel);
  const RenderResult result = Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, {});
  ExpectSound(result);
  // Depth is exact wherever something is drawn, also where triangles pass through the near plane.
  int seen = 0;
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      if (result.coverage(x, y) == 0 || truth.depth(x, y) <= 0) continue;
      EXPECT_NEAR(result.depth(x, y), truth.depth(x, y), 0.02 * truth.depth(x, y));
      ++seen;
    }
  }
  EXPECT_GT(seen, 1000);
  RenderOptions splats = OptionsOf(RenderMethod::kTwoPass);
  splats.primitive = Primitive::kSplat;
  ExpectSound(Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, splats));
}

TEST(Render, OneTriangleThroughTheNearPlane) {
  // Two samples per axis and a camera between them: every triangle is cut.
  View view = Photograph(Plane({0, -1, 0.2}, -1), ShotFrom("a", {0, 0, 0}, {0, 1, 1}));
  DtrSet set = SetOf({view});
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
  options.resolution = 40;
  options.max_angle_rad = std::numbers::pi;
  const Shot novel = ShotFrom("n", {0, 0.9, 1}, {0, 1.5, 2.6});
  const RenderResult result =
      Render(MakeRenderScene(set), novel.camera, novel.cam_from_world, options);
  ExpectSound(result);
  EXPECT_GT(result.coverage_share, 0.1);
}

TEST(Render, SmallestPicturesAndEmptyDepth) {
  DtrSet set = SquareBeforePlane();
  const PinholeCamera pixel(1, 1, 1, 1, 0.5, 0.5);
  const RenderResult one = Render(MakeRenderScene(set), pixel, LookAt({0, 0, 0}, {0, 0, 10}), {});
  EXPECT_EQ(one.coverage(0, 0), 255);
  EXPECT_NEAR(one.depth(0, 0), 5, 1e-5);
  for (View& view : set.frames[0].views) view.depth = DepthImage(96, 72);
  const RenderResult none = Render(MakeRenderScene(set), pixel, LookAt({0, 0, 0}, {0, 0, 10}), {});
  EXPECT_TRUE(Empty(none));
  RenderOptions coarse = OptionsOf(RenderMethod::kTwoPass);
  coarse.resolution = 1000;
  EXPECT_TRUE(Empty(Render(MakeRenderScene(set), pixel, LookAt({0, 0, 0}, {0, 0, 10}), coarse)));
}

TEST(Render, ALoneOneByOneViewIsDrawnAsItsCell) {
  View view;
  view.id = "dot";
  view.camera = PinholeCamera(1, 1, 10, 10, 0.5, 0.5);
  view.image = ImageRgb8(1, 1, 3, 200);
  view.depth = DepthImage(1, 1);
  view.depth(0, 0) = 10;
  const DtrSet set = SetOf({view});
  const PinholeCamera camera(32, 32, 100, 100, 16, 16);
  const RenderResult result = Render(MakeRenderScene(set), camera, Pose{}, {});
  const auto covered =
      std::count(result.coverage.data().begin(), result.coverage.data().end(), 255);
  EXPECT_EQ(covered, 100);  // one pixel at f = 10 is ten by ten at f = 100
  EXPECT_EQ(result.image(16, 16, 0), 200);
}

TEST(Render, RejectsWhatHasNoMeaning) {
  const DtrSet set = SquareBeforePlane();
  const RenderScene scene = MakeRenderScene(set);
  Pose pose;
  pose.translation.x() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Render(scene, Shot{}.camera, pose, {}), Error);
  const PinholeCamera huge(1 << 20, 1 << 20, 1, 1, 0, 0);
  EXPECT_THROW(Render(scene, huge, Pose{}, {}), UsageError);
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
  options.views = 0;
  EXPECT_THROW(Render(scene, Shot{}.camera, Pose{}, options), UsageError);
}

/// A view of random size, pose, depth and extremes of every kind.
View RandomView(Random& random, int index) {
  const double scale = std::pow(10.0, random.Uniform(-6, 6));
  const int width = 1 + random.Index(12), height = 1 + random.Index(12);
  View view;
  view.id = "v" + std::to_string(index);
  const double focal = std::pow(10.0, random.Uniform(-1, 4));
  view.camera = PinholeCamera(width, height, focal, focal * random.Uniform(0.5, 2),
                              random.Uniform(-20, 20), random.Uniform(-20, 20));
  view.cam_from_world.rotation =
      Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
          .normalized();
  view.cam_from_world.translation =
      Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()) * scale;
  view.image = ImageRgb8(width, height, 3);
  for (auto& level : view.image.data()) level = static_cast<std::uint8_t>(random.Index(256));
  view.depth = DepthImage(width, height);
  constexpr float kOdd[] = {0,
                            -1,
                            1e-38f,
                            3e38f,
                            std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::quiet_NaN()};
  for (float& z : view.depth.grid().data()) {
    z = random.Index(4) == 0 ? kOdd[random.Index(6)]
                             : static_cast<float>(scale * std::pow(10.0, random.Uniform(-2, 2)));
  }
  view.reference_baseline = random.Index(3) == 0 ? 0 : scale * random.Uniform();
  return view;
}

TEST(Render, RandomCamerasGiveNoNanAndNoInfinity) {
  constexpr int kScenes = 1500;  // about a second; every draw is its own scene and camera
  for (int n = 0; n < kScenes; ++n) {
    Random random(static_cast<std::uint64_t>(n));
    RenderScene scene;
    std::vector<View> views;
    for (int i = 0; i <= random.Index(5); ++i) views.push_back(RandomView(random, i));
    for (const View& view : views) scene.views.push_back(&view);
    const View novel = RandomView(random, 99);
    RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
    options.views = 1 + random.Index(6);
    options.method = static_cast<RenderMethod>(n % 2);
    options.primitive = static_cast<Primitive>(random.Index(2));
    options.blend = static_cast<BlendWeight>(random.Index(5));
    options.exponent = std::pow(10.0, random.Uniform(-3, 3));
    options.falloff = std::pow(10.0, random.Uniform(-3, 6));
    options.resolution = 1 + random.Index(3);
    options.max_angle_rad = random.Uniform(0.01, std::numbers::pi);
    options.delta_px = std::pow(10.0, random.Uniform(-3, 3));
    if (random.Index(4) == 0) options.absolute_delta = random.Uniform(0, 10);
    options.blend_in_linear_light = random.Index(2) == 0;
    // Half of the time the novel camera is one of the views, exactly or nearly.
    Pose pose = random.Index(2) == 0 ? novel.cam_from_world : views[0].cam_from_world;
    if (random.Index(3) == 0) pose.translation.x() += 1e-12;
    SCOPED_TRACE(n);
    ExpectSound(Render(scene, novel.camera, pose, options));
    if (HasFatalFailure()) return;
  }
}

/// A scene whose views have no pixels, and the views that `novel` needs.
std::vector<int> Unload(const Pose& novel_from_world, const RenderOptions& options, DtrSet& set) {
  for (View& view : set.frames[0].views) {
    view.image = {};
    view.depth = {};
  }
  return ViewsNeeded(DescribeRenderScene(set), std::span(&novel_from_world, 1), options);
}

TEST(PartlyLoadedScene, DrawsTheSamePictureAsTheWholeOne) {
  const DtrSet whole = testing::SquareBeforePlane();
  const View novel = whole.frames[0].views[1];
  RenderOptions options = OptionsOf(RenderMethod::kTwoPass);
  options.views = 2;
  options.fill_holes = true;
  DtrSet part = whole;
  const std::vector<int> needed = Unload(novel.cam_from_world, options, part);
  EXPECT_EQ(needed.size(), 2u);
  const RenderScene scene = DescribeRenderScene(part);
  for (const int index : needed) {
    const auto slot =
        static_cast<size_t>(scene.views[static_cast<size_t>(index)] - part.frames[0].views.data());
    part.frames[0].views[slot] = whole.frames[0].views[slot];
  }
  const RenderResult expected =
      cpu::Render(MakeRenderScene(whole), novel.camera, novel.cam_from_world, options);
  const RenderResult found = cpu::Render(scene, novel.camera, novel.cam_from_world, options);
  testing::ExpectSameBytes(found, expected);
  EXPECT_EQ(found.views_used, expected.views_used);
}

TEST(PartlyLoadedScene, ViewWithoutPixelsIsNeverDrawnAsEmpty) {
  DtrSet set = testing::SquareBeforePlane();
  const View novel = set.frames[0].views[1];
  Unload(novel.cam_from_world, {}, set);
  EXPECT_THROW(cpu::Render(DescribeRenderScene(set), novel.camera, novel.cam_from_world, {}),
               Error);
  EXPECT_THROW(MakeRenderScene(set), Error);
}

}  // namespace
}  // namespace dtr::cpu
