// datasets/scenes_simple.cpp -- plane, sphere, stairs: scenes whose depth is known by hand.
#include <cmath>
#include <numbers>

#include "datasets/scene_builder.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;
using Pattern = Material::Pattern;

constexpr double kPlaneTiltDeg = 25;  // against the viewing direction of the middle camera
constexpr double kBallRadius = 1.5, kRollingSpeed = 1;  // scene units, and per second
constexpr double kPlaneHalf = 200;  // wide enough to fill every frame of its layouts

}  // namespace

Scene MakePlane(std::uint64_t seed) {
  SceneBuilder b(seed);
  const int painted = b.Add(
      {.pattern = Pattern::kPainting, .color = {0.45, 0.38, 0.30}, .cell = 1.1, .contrast = 0.4});
  // Through the origin, facing -y, its top leaning back.
  const double tilt = kPlaneTiltDeg * std::numbers::pi / 180;
  b.Rectangle(Vector3d::Zero(), kPlaneHalf * Vector3d::UnitX(),
              kPlaneHalf * Vector3d(0, std::sin(tilt), std::cos(tilt)), painted);
  Framing framing;
  framing.distance = 6;
  framing.max_arc_deg = 70;
  framing.layouts = {"arc", "grid", "line"};
  return std::move(b).Build("plane", Daylight(), framing);
}

Scene MakeSphere(std::uint64_t seed, double time_s) {
  SceneBuilder b(seed);
  const int ball = b.Add({.pattern = Pattern::kMarble,
                          .color = {0.75, 0.45, 0.25},
                          .color2 = {0.12, 0.20, 0.35},
                          .contrast = 0.5});
  const int backdrop = b.Add(
      {.pattern = Pattern::kPainting, .color = {0.35, 0.40, 0.45}, .cell = 1.4, .contrast = 0.45});
  const int floor = b.Add({.pattern = Pattern::kPaving,
                           .color = {0.45, 0.42, 0.38},
                           .color2 = {0.12, 0.11, 0.10},
                           .cell = 0.6});
  // It rolls along x without slipping; its marble turns with it.
  Primitive& rolling = b.Sphere({kRollingSpeed * time_s, 0, 0}, kBallRadius, ball);
  const double turn_rad = kRollingSpeed * time_s / kBallRadius;
  rolling.local_from_world = Eigen::AngleAxisd(-turn_rad, Vector3d::UnitY()).toRotationMatrix();
  b.Rectangle({0, 4, 0}, 40 * Vector3d::UnitX(), 40 * Vector3d::UnitZ(), backdrop);
  b.Rectangle({0, 0, -kBallRadius}, 40 * Vector3d::UnitX(), 40 * Vector3d::UnitY(), floor);
  AddSky(b, 100);
  Framing framing;
  framing.distance = 6;
  framing.height = 0.8;
  framing.max_arc_deg = 90;
  framing.ring_radius = 3.4;
  framing.layouts = {"arc", "grid", "line", "ring"};
  return std::move(b).Build("sphere", Daylight(), framing);
}

Scene MakeStairs(std::uint64_t seed) {
  SceneBuilder b(seed);
  const int stone = b.Add({.pattern = Pattern::kPaving,
                           .color = {0.55, 0.50, 0.43},
                           .color2 = {0.15, 0.13, 0.11},
                           .cell = 0.45,
                           .contrast = 0.5});
  const int wall = b.Add({.pattern = Pattern::kPlaster,
                          .color = {0.62, 0.50, 0.36},
                          .color2 = {0.35, 0.30, 0.26},
                          .contrast = 0.5});
  const int brick = b.Add({.pattern = Pattern::kBrick,
                           .color = {0.50, 0.22, 0.14},
                           .color2 = {0.50, 0.47, 0.43},
                           .cell = 0.11});
  constexpr int kSteps = 8;
  constexpr double kRun = 0.6, kRise = 0.35, kHalfWidth = 3.5;
  for (int i = 0; i < kSteps; ++i) {
    // Step i: its front stands at y = kRun i, its tread at z = kRise (i + 1).
    const double depth = kRun * (kSteps - i), height = kRise * (i + 1);
    b.Box({0, kRun * i + depth / 2, height / 2}, {kHalfWidth, depth / 2, height / 2}, stone);
  }
  b.Box({0, kRun * kSteps + 0.25, 3.5}, {9, 0.25, 3.5}, brick);
  b.Box({-kHalfWidth - 0.3, 2.4, 1.9}, {0.3, 2.4, 1.9}, wall);
  b.Box({kHalfWidth + 0.3, 2.4, 1.9}, {0.3, 2.4, 1.9}, wall);
  b.Rectangle(Vector3d::Zero(), 90 * Vector3d::UnitX(), 90 * Vector3d::UnitY(), stone);
  AddSky(b, 80);
  Framing framing;
  framing.focus = {0, 1.5, 1.2};
  framing.distance = 7.5;
  framing.height = 1.4;
  framing.max_arc_deg = 60;
  framing.layouts = {"arc", "grid", "line"};
  return std::move(b).Build("stairs", Daylight(), framing);
}

}  // namespace dtr::datasets
