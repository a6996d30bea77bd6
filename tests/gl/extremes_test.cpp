// Cameras, depth and options that nobody would choose: no NaN, no infinity, no contradiction.
// DTR_EXTREME_CAMERAS sets how many random cameras are tried (200); docs/accuracy/RENDERING.md has
// the longest run.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "dtr/cpu/renderer.h"
#include "tests/gl/gl_testing.h"

namespace dtr::gl {
namespace {

using namespace dtr::testing;
using Extremes = GlTest;

int CamerasToTry() {
  const char* given = std::getenv("DTR_EXTREME_CAMERAS");
  return given != nullptr ? std::atoi(given) : 200;
}

/// Depth from 0.001 to 1000 in one map, holes between, and depths that no camera measures.
NamedScene WildDepth() {
  NamedScene scene{"near to far 1 : 1e6", SquareBeforePlane(), ShotFrom("n", {0, 0, 0}, {0, 0, 9})};
  Random random(5);
  constexpr float kOdd[] = {0, -1, 1e-38f, 3e38f, INFINITY, NAN};
  for (View& view : scene.set.frames[0].views) {
    for (float& z : view.depth.grid().data()) {
      z = static_cast<float>(std::pow(10.0, random.Uniform(-3, 3)));
      if (random.Index(9) == 0) z = kOdd[random.Index(6)];
    }
  }
  return scene;
}

NamedScene OnlyHoles() {
  NamedScene scene{"holes", SquareBeforePlane(), ShotFrom("n", {0, 0, 0}, {0, 0, 9})};
  for (View& view : scene.set.frames[0].views) {
    std::fill(view.depth.grid().data().begin(), view.depth.grid().data().end(), 0.0f);
  }
  return scene;
}

NamedScene OneView() {
  NamedScene scene{"one view", SquareBeforePlane(), ShotFrom("n", {0, 0, 0}, {0, 0, 9})};
  scene.set.frames[0].views.resize(1);
  FinishGeometry(scene.set);
  return scene;
}

/// More views than the shaders' smallest variants hold.
NamedScene ManyViews() {
  return {"64 views", FromAround(Plane({0.4, 0.1, 0.9}, 8), 64, 0.8, {0, 0, 9}),
          ShotFrom("n", {0, 0, 0}, {0, 0, 9})};
}

/// Smallest and largest value of any photo, by channel.
struct Levels {
  std::array<int, 3> least{255, 255, 255}, most{};
};

Levels LevelsOf(const DtrSet& set) {
  Levels levels;
  for (const View& view : set.frames[0].views) {
    if (view.gain != Eigen::Vector3d::Ones()) return {{0, 0, 0}, {255, 255, 255}};
    const auto& values = view.image.data();
    for (size_t p = 0; p < values.size(); ++p) {
      levels.least[p % 3] = std::min<int>(levels.least[p % 3], values[p]);
      levels.most[p % 3] = std::max<int>(levels.most[p % 3], values[p]);
    }
  }
  return levels;
}

/// Seen pixels that no mean of the photos' colours gives: what a colour that was NaN becomes in 8
/// bits.
int PixelsBeyond(const Levels& levels, const RenderResult& result) {
  int beyond = 0;
  for (size_t p = 0; p < result.image.data().size(); ++p) {
    if (result.coverage.data()[p / 3] == 0) continue;
    const int value = result.image.data()[p];
    beyond += value < levels.least[p % 3] - 1 || value > levels.most[p % 3] + 1;
  }
  return beyond;
}

/// At an input camera, by a hair beside it, inside the geometry, behind everything, anywhere.
Eigen::Vector3d OddCentre(const View& near, Random& random) {
  const Eigen::Vector3d any(random.Normal(), random.Normal(), random.Normal());
  switch (random.Index(5)) {
    case 0:
      return near.CenterInWorld();
    case 1:
      return near.CenterInWorld() + 1e-7 * any;
    case 2: {
      const int x = random.Index(near.depth.width()), y = random.Index(near.depth.height());
      const float z = near.depth(x, y);
      const double inside = z > 0 && z < 1e4f ? z : 1;
      return near.cam_from_world.Inverse() *
             near.DepthCamera().CamFromPixel({x + 0.5, y + 0.5}, inside, DepthKind::kPlaneZ);
    }
    case 3:
      return {any.x(), any.y(), 30};
    default:
      return 12 * any;
  }
}

Shot OddShot(const RenderScene& views, Random& random) {
  const View& near =
      *views.views[static_cast<size_t>(random.Index(static_cast<int>(views.views.size())))];
  Shot shot;
  const int kind = random.Index(8);
  const int width = kind == 0 ? 1 : 24, height = kind == 0 ? 1 : kind == 1 ? 40 : 18;
  const double degrees =
      random.Index(3) == 0 ? 170 : (random.Index(2) == 0 ? 5 : random.Uniform(20, 120));
  const double focal = 0.5 * width / std::tan(degrees / 360 * std::numbers::pi);
  shot.camera = PinholeCamera(width, height, focal, focal, width / 2.0, height / 2.0);
  const Eigen::Vector3d centre = OddCentre(near, random);
  shot.cam_from_world =
      random.Index(3) == 0
          ? Pose{near.cam_from_world.rotation, -(near.cam_from_world.rotation * centre)}
          : LookAt(centre, {random.Normal(), random.Normal(), random.Index(4) == 0 ? -8.0 : 8.0});
  return shot;
}

RenderOptions OddOptions(Random& random) {
  RenderOptions options;
  options.method = kBothMethods[random.Index(2)];
  options.primitive = random.Index(2) == 0 ? Primitive::kMesh : Primitive::kSplat;
  options.blend = kAllWeights[random.Index(5)];
  const int views[] = {1, 2, 8, 64};
  options.views = views[random.Index(4)];
  const int resolutions[] = {1, 1, 2, 64};
  options.resolution = resolutions[random.Index(4)];
  options.max_angle_rad = random.Index(2) == 0 ? std::numbers::pi : random.Uniform(0.01, 1.5);
  options.exponent = random.Index(4) == 0 ? 1000 : 8;
  options.falloff = random.Index(4) == 0 ? 1e6 : 8;
  if (random.Index(6) == 0) options.absolute_delta = random.Uniform(0, 5);
  options.blend_in_linear_light = random.Index(2) == 0;
  return options;
}

TEST_F(Extremes, RandomCamerasGiveNoNanAndNoContradiction) {
  std::vector<NamedScene> scenes = ParityScenes();
  for (NamedScene& odd : std::vector{WildDepth(), OnlyHoles(), OneView(), ManyViews()}) {
    scenes.push_back(std::move(odd));
  }
  const int cameras = CamerasToTry();
  // Options change less often than cameras: other resolutions and primitives need other meshes.
  const int cameras_per_options = std::max(4, cameras / 500);
  int seen = 0;
  for (size_t i = 0; i < scenes.size(); ++i) {
    const RenderScene views = MakeRenderScene(scenes[i].set);
    const Levels levels = LevelsOf(scenes[i].set);
    Renderer by_shaders;
    FittingRenderer fitting({}, Drawer::kSimd);
    RenderOptions options;
    for (int k = static_cast<int>(i); k < cameras; k += static_cast<int>(scenes.size())) {
      Random random(static_cast<std::uint64_t>(k));
      if (k / static_cast<int>(scenes.size()) % cameras_per_options == 0)
        options = OddOptions(random);
      const Shot shot = OddShot(views, random);
      SCOPED_TRACE(scenes[i].name + ", camera " + std::to_string(k));
      const bool simd = k / static_cast<int>(scenes.size()) % 2 == 0;
      const RenderResult result =
          simd ? fitting.Render(views, shot.camera, shot.cam_from_world, options)
               : by_shaders.Render(views, shot.camera, shot.cam_from_world, options);
      ExpectSound(result);
      EXPECT_EQ(PixelsBeyond(levels, result), 0);
      if (HasFatalFailure()) return;
      seen += result.coverage_share > 0;
    }
  }
  std::printf("%d cameras, %d of them saw something\n", cameras, seen);
  EXPECT_GT(seen, cameras / 4);
}

TEST_F(Extremes, NoViewAndNoDepthGiveAnEmptyPicture) {
  const DtrSet set = SquareBeforePlane();
  const Shot behind = ShotFrom("n", {0, 0, 30}, {0, 0, 10});
  const NamedScene holes = OnlyHoles();
  for (const RenderMethod method : kBothMethods) {
    for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
      RenderOptions options = OptionsOf(method);
      options.primitive = primitive;
      Renderer renderer;
      const RenderResult none =
          renderer.Render(MakeRenderScene(set), behind.camera, behind.cam_from_world, options);
      EXPECT_TRUE(none.views_used.empty());
      EXPECT_EQ(none.coverage_share, 0);
      ExpectSound(none);
      const RenderResult empty = renderer.Render(MakeRenderScene(holes.set), holes.novel.camera,
                                                 holes.novel.cam_from_world, options);
      EXPECT_EQ(empty.coverage_share, 0);
      ExpectSound(empty);
    }
  }
}

TEST_F(Extremes, PicturesOf8192PixelsASide) {
  constexpr int kLong = 8192, kShort = 6;
  const NamedScene scene = ParityScenes()[1];
  const RenderScene views = MakeRenderScene(scene.set);
  Renderer renderer;
  for (const bool wide : {true, false}) {
    const int width = wide ? kLong : kShort, height = wide ? kShort : kLong;
    const PinholeCamera camera(width, height, kLong, kLong, width / 2.0, height / 2.0);
    for (const RenderMethod method : kBothMethods) {
      const RenderOptions options = OptionsOf(method);
      const RenderResult result =
          renderer.Render(views, camera, scene.novel.cam_from_world, options);
      ExpectSound(result);
      EXPECT_GT(result.coverage_share, 0.5);
      const RenderResult expected = cpu::Render(views, camera, scene.novel.cam_from_world, options);
      ExpectSound(expected);
      EXPECT_NEAR(result.coverage_share, expected.coverage_share, 0.01);
    }
  }
}

}  // namespace
}  // namespace dtr::gl
