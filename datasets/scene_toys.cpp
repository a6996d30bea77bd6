// datasets/scene_toys.cpp -- a dynamic scene: two toys move, one turns, all else stands still.
#include <cmath>
#include <numbers>

#include "datasets/scene_builder.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;
using Pattern = Material::Pattern;

constexpr double kToyBallRadius = 0.5, kToyBallReach = 1.9, kToyBallRadPerS = 0.55;
constexpr double kCrateHalf = 0.4, kCrateReach = 1.3, kCrateRadPerS = 0.5;
constexpr double kTurnDegPerS = 30;  // of the painted box

double Degrees(double rad) { return rad * 180 / std::numbers::pi; }

/// Rolls to and fro along x without slipping, in front of all else.
void AddBall(SceneBuilder& b, double time_s, int material) {
  const double x = kToyBallReach * std::sin(kToyBallRadPerS * time_s - 0.8);
  Primitive& ball = b.Sphere({x, -1.3, kToyBallRadius}, kToyBallRadius, material);
  ball.local_from_world =
      Eigen::AngleAxisd(-x / kToyBallRadius, Vector3d::UnitY()).toRotationMatrix();
}

/// Slides on an arc behind the ball and keeps its front to the path.
void AddCrate(SceneBuilder& b, double time_s, int material) {
  const double angle = kCrateRadPerS * time_s + 0.4;
  const Vector3d at(kCrateReach * std::cos(angle), 0.5 + 0.4 * std::sin(angle), kCrateHalf);
  b.Box(at, Vector3d::Constant(kCrateHalf), material, Degrees(0.5 * angle));
}

void AddRest(SceneBuilder& b) {
  const int brick = b.Add({.pattern = Pattern::kBrick,
                           .color = {0.50, 0.24, 0.16},
                           .color2 = {0.50, 0.47, 0.43},
                           .cell = 0.14});
  const int floor = b.Add({.pattern = Pattern::kPaving,
                           .color = {0.47, 0.43, 0.38},
                           .color2 = {0.14, 0.12, 0.11},
                           .cell = 0.45,
                           .contrast = 0.5});
  const int stone = b.Add({.pattern = Pattern::kPlaster,
                           .color = {0.60, 0.52, 0.40},
                           .color2 = {0.33, 0.29, 0.25},
                           .contrast = 0.5});
  const int leaves = b.Add(
      {.pattern = Pattern::kFoliage, .color = {0.14, 0.30, 0.09}, .color2 = {0.30, 0.36, 0.10}});
  b.Rectangle({0, 2.6, 0}, 40 * Vector3d::UnitX(), 40 * Vector3d::UnitZ(), brick);
  b.Rectangle(Vector3d::Zero(), 40 * Vector3d::UnitX(), 40 * Vector3d::UnitY(), floor);
  b.Rod({-2.4, 1.2, 0}, {-2.4, 1.2, 2.8}, 0.25, stone);
  b.Box({2.6, 1.4, 0.45}, {0.5, 0.5, 0.45}, stone, 20);
  b.Sphere({2.6, 1.4, 1.25}, 0.55, leaves);
  b.Box({-1.1, 2.2, 0.35}, {0.8, 0.2, 0.35}, stone);
  b.Rod({0.3, 1.7, 0}, {0.3, 1.7, 0.5}, 0.7, stone);  // under the box that turns
}

}  // namespace

Scene MakeToys(std::uint64_t seed, double time_s) {
  SceneBuilder b(seed);
  const int ball = b.Add({.pattern = Pattern::kMarble,
                          .color = {0.75, 0.45, 0.25},
                          .color2 = {0.12, 0.20, 0.35},
                          .contrast = 0.5});
  const int crate = b.Add({.pattern = Pattern::kPlanks,
                           .color = {0.55, 0.36, 0.18},
                           .color2 = {0.10, 0.06, 0.03},
                           .cell = 0.16,
                           .contrast = 0.5});
  const int painted = b.Add(
      {.pattern = Pattern::kPainting, .color = {0.35, 0.42, 0.50}, .cell = 0.5, .contrast = 0.45});
  AddRest(b);
  AddBall(b, time_s, ball);
  AddCrate(b, time_s, crate);
  b.Box({0.3, 1.7, 1.1}, {0.45, 0.35, 0.6}, painted, kTurnDegPerS * time_s + 15);
  AddSky(b, 80);
  Framing framing;
  framing.focus = {0, 0.8, 0.9};
  framing.distance = 6;
  framing.height = 1.1;
  framing.max_arc_deg = 60;
  framing.layouts = {"arc", "grid", "line"};
  return std::move(b).Build("toys", Daylight(), framing);
}

}  // namespace dtr::datasets
