// datasets/scene_courtyard.cpp -- a walled yard, open towards the cameras.
#include <array>
#include <numbers>
#include <utility>

#include "datasets/scene_builder.h"
#include "dtr/base/random.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;
using Pattern = Material::Pattern;

/// The yard's materials, by what they are.
struct CourtyardPalette {
  int paving, brick, plaster, bare, stone, marble, wood, dark_wood, tiles, slate, metal, painting,
      glass, leaves, dark_leaves, clay;
};

CourtyardPalette MakeCourtyardPalette(SceneBuilder& b) {
  CourtyardPalette p;
  p.paving = b.Add({.pattern = Pattern::kPaving,
                    .color = {0.46, 0.43, 0.38},
                    .color2 = {0.13, 0.12, 0.09},
                    .cell = 0.7,
                    .contrast = 0.42});
  p.brick = b.Add({.pattern = Pattern::kBrick,
                   .color = {0.46, 0.20, 0.13},
                   .color2 = {0.48, 0.45, 0.40},
                   .cell = 0.16,
                   .contrast = 0.42});
  p.plaster = b.Add({.pattern = Pattern::kPlaster,
                     .color = {0.66, 0.52, 0.33},
                     .color2 = {0.38, 0.31, 0.24},
                     .contrast = 0.36});
  p.bare = b.Add({.pattern = Pattern::kFlat, .color = {0.62, 0.60, 0.56}});
  p.stone = b.Add({.pattern = Pattern::kPlaster,
                   .color = {0.55, 0.52, 0.46},
                   .color2 = {0.30, 0.28, 0.25},
                   .contrast = 0.45});
  p.marble = b.Add({.pattern = Pattern::kMarble,
                    .color = {0.72, 0.68, 0.62},
                    .color2 = {0.22, 0.23, 0.27},
                    .contrast = 0.34});
  p.wood = b.Add({.pattern = Pattern::kPlanks,
                  .color = {0.48, 0.30, 0.16},
                  .color2 = {0.06, 0.04, 0.03},
                  .cell = 0.19,
                  .contrast = 0.45});
  p.dark_wood = b.Add({.pattern = Pattern::kPlanks,
                       .color = {0.22, 0.14, 0.08},
                       .color2 = {0.03, 0.02, 0.02},
                       .cell = 0.14,
                       .contrast = 0.5});
  p.tiles = b.Add(
      {.pattern = Pattern::kTiles, .color = {0.50, 0.21, 0.11}, .cell = 0.30, .contrast = 0.42});
  p.slate = b.Add(
      {.pattern = Pattern::kTiles, .color = {0.20, 0.24, 0.29}, .cell = 0.26, .contrast = 0.45});
  p.metal = b.Add({.pattern = Pattern::kPlaster,
                   .color = {0.10, 0.13, 0.12},
                   .color2 = {0.25, 0.15, 0.09},
                   .contrast = 0.4});
  p.painting = b.Add(
      {.pattern = Pattern::kPainting, .color = {0.60, 0.55, 0.42}, .cell = 0.8, .contrast = 0.2});
  p.glass = b.Add({.pattern = Pattern::kMarble,
                   .color = {0.10, 0.15, 0.20},
                   .color2 = {0.30, 0.36, 0.42},
                   .contrast = 0.3});
  p.leaves = b.Add({.pattern = Pattern::kFoliage,
                    .color = {0.24, 0.38, 0.10},
                    .color2 = {0.03, 0.07, 0.02},
                    .contrast = 0.5});
  p.dark_leaves = b.Add({.pattern = Pattern::kFoliage,
                         .color = {0.14, 0.25, 0.09},
                         .color2 = {0.02, 0.04, 0.02},
                         .contrast = 0.5});
  p.clay = b.Add({.pattern = Pattern::kMarble,
                  .color = {0.52, 0.27, 0.16},
                  .color2 = {0.34, 0.16, 0.10},
                  .contrast = 0.4});
  return p;
}

/// Floor, walls, door, windows and posters. The right wall is the one without texture.
void AddWalls(SceneBuilder& b, const CourtyardPalette& p) {
  b.Rectangle(Vector3d::Zero(), 95 * Vector3d::UnitX(), 95 * Vector3d::UnitY(), p.paving);
  b.Box({0, 9.25, 2.6}, {11.5, 0.25, 2.6}, p.brick);
  b.Box({0, 9.25, 5.3}, {11.7, 0.4, 0.1}, p.stone);
  b.Box({-11.25, 3.0, 2.1}, {0.25, 6.0, 2.1}, p.plaster);
  b.Box({-11.25, 3.0, 4.28}, {0.38, 6.1, 0.08}, p.tiles);
  b.Box({11.25, 3.0, 2.1}, {0.25, 6.0, 2.1}, p.bare);
  b.Box({11.25, 3.0, 4.28}, {0.38, 6.1, 0.08}, p.stone);
  b.Box({11.0, 3.0, 0.25}, {0.12, 6.0, 0.25}, p.stone);
  for (const double x : {-9.0, -3.0, 3.0, 9.0}) {
    b.Box({x - 1.5, 8.98, 1.9}, {0.62, 0.06, 0.8}, p.dark_wood);
    b.Box({x - 1.5, 8.95, 1.9}, {0.5, 0.06, 0.68}, p.glass);
    b.Box({x - 1.5, 8.9, 1.05}, {0.72, 0.16, 0.05}, p.stone);
  }
  b.Box({0, 8.95, 1.25}, {0.75, 0.08, 1.25}, p.wood);
  for (int i = 0; i < 3; ++i) {
    b.Box({0, 8.6 - 0.35 * i, 0.3 - 0.1 * i}, {1.3, 0.3, 0.1}, p.stone);
  }
  for (int i = 0; i < 4; ++i) {
    b.Box({-10.97, -1.6 + 2.6 * i, 1.9 + 0.15 * (i % 2)}, {0.04, 0.65, 0.85}, p.painting);
  }
}

/// A colonnade along the back wall under a lean-to roof of tiles.
void AddArcade(SceneBuilder& b, const CourtyardPalette& p) {
  for (int i = 0; i < 7; ++i) {
    const double x = -9.0 + 3.0 * i;
    b.Box({x, 6.8, 0.15}, {0.42, 0.42, 0.15}, p.stone, 3.0 * i);
    b.Rod({x, 6.8, 0.3}, {x, 6.8, 2.9}, 0.25, p.marble);
    b.Box({x, 6.8, 3.0}, {0.38, 0.38, 0.1}, p.stone);
  }
  b.Box({0, 6.8, 3.22}, {9.8, 0.22, 0.12}, p.dark_wood);
  b.Slab({0, 7.72, 3.86}, 10.2 * Vector3d::UnitX(), Vector3d(0, 1.4, 0.55), 0.06, p.tiles);
}

/// A house of `half` extents with a gable roof whose ridge runs along its own x.
void AddHouse(SceneBuilder& b, const Vector3d& foot, const Vector3d& half, double rise,
              double turn_deg, int wall, int roof) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(turn_deg * std::numbers::pi / 180, Vector3d::UnitZ()).matrix();
  const auto at = [&](double x, double y, double z) -> Vector3d {
    return foot + turn * Vector3d(x, y, z);
  };
  b.Box(at(0, 0, half.z()), half, wall, turn_deg);
  const double top = 2 * half.z(), over = 0.25;
  for (const double side : {-1.0, 1.0}) {
    b.Triangle(at(side * half.x(), -half.y(), top), at(side * half.x(), half.y(), top),
               at(side * half.x(), 0, top + rise), wall);
    const Vector3d slope(0, -side * (half.y() + over), rise * (half.y() + over) / half.y());
    b.Slab(at(0, side * (half.y() + over) / 2, top + rise - slope.z() / 2 + 0.06),
           turn * Vector3d(half.x() + over, 0, 0), turn * slope / 2, 0.05, roof);
  }
}

/// A fountain, statues, lamp posts, a fence of thin rods, and what stands about in a yard.
void AddFurnishing(SceneBuilder& b, const CourtyardPalette& p, Random& random) {
  b.Rod({0.3, 2.4, 0}, {0.3, 2.4, 0.45}, 1.35, p.stone);
  b.Rod({0.3, 2.4, 0.4}, {0.3, 2.4, 0.5}, 1.15, p.glass);
  b.Rod({0.3, 2.4, 0.4}, {0.3, 2.4, 1.5}, 0.16, p.marble);
  b.Rod({0.3, 2.4, 1.5}, {0.3, 2.4, 1.6}, 0.6, p.stone);
  b.Sphere({0.3, 2.4, 1.95}, 0.38, p.marble);
  for (const double side : {-1.0, 1.0}) {
    b.Box({0.3 + side * 3.1, 3.6, 0.4}, {0.32, 0.32, 0.4}, p.stone, 20 * side);
    b.Sphere({0.3 + side * 3.1, 3.6, 1.25}, 0.45, side < 0 ? p.clay : p.marble);
    const double x = 5.8 * side;
    b.Rod({x, 0.6, 0}, {x, 0.6, 3.6}, 0.045, p.metal);
    b.Rod({x, 0.6, 3.4}, {x + 0.7, 0.6, 3.7}, 0.025, p.metal);
    b.Sphere({x + 0.7, 0.6, 3.55}, 0.16, p.painting);
  }
  for (int i = 0; i < 13; ++i) {
    const double x = 2.6 + 0.26 * i;
    b.Rod({x, 4.9, 0}, {x, 4.9, 1.25}, 0.018, p.metal);
  }
  b.Rod({2.45, 4.9, 1.1}, {5.85, 4.9, 1.1}, 0.022, p.metal);
  b.Rod({2.45, 4.9, 0.25}, {5.85, 4.9, 0.25}, 0.022, p.metal);
  b.Rod({-7.9, 5.9, 0}, {-7.3, 6.1, 4.6}, 0.035, p.wood);
  constexpr std::array<std::array<double, 4>, 7> kCrates = {{{7.6, 3.2, 0.45, 12},
                                                             {8.5, 3.5, 0.4, -20},
                                                             {7.9, 4.3, 0.5, 34},
                                                             {-1.9, 5.7, 0.35, 8},
                                                             {-8.9, 1.2, 0.5, 25},
                                                             {-9.3, 2.4, 0.38, -14},
                                                             {5.0, 6.0, 0.4, 41}}};
  for (const auto& [x, y, half, turn] : kCrates) {
    b.Box({x, y, half}, {half, half, half}, p.wood, turn + random.Uniform(-6, 6));
  }
  b.Box({8.0, 3.7, 1.15}, {0.3, 0.3, 0.27}, p.dark_wood, 50);
  for (const auto& [x, y] : {std::pair{-8.6, 4.6}, {-7.9, 4.9}, {9.6, 1.0}, {9.9, 5.6}}) {
    b.Rod({x, y, 0}, {x, y, 0.95}, 0.33, p.dark_wood);
  }
  b.Box({-3.4, 0.9, 0.45}, {0.95, 0.22, 0.04}, p.wood, 24);
  b.Slab({-3.5, 1.2, 0.85}, Vector3d(0.868, 0.386, 0), Vector3d(-0.03, 0.07, 0.25), 0.03, p.wood);
  b.Box({-4.0, 0.6, 0.2}, {0.06, 0.2, 0.21}, p.metal, 24);
  b.Box({-2.75, 1.15, 0.2}, {0.06, 0.2, 0.21}, p.metal, 24);
  b.Slab({10.2, 7.0, 1.3}, Vector3d(0, 0.7, 0), Vector3d(0.45, 0, 1.25), 0.04, p.painting);
}

/// A trunk under a crown of several balls of leaves, as wide as a ball of `radius`.
void AddTree(SceneBuilder& b, const CourtyardPalette& p, const Vector3d& foot, double radius,
             Random& random) {
  const Vector3d crown = foot + Vector3d(0, 0, 3.2 + radius);
  b.Rod(foot, crown, 0.25, p.dark_wood);
  b.Sphere(crown, 0.62 * radius, p.dark_leaves);
  for (int i = 0; i < 9; ++i) {
    const Vector3d out = Vector3d(random.Normal(), random.Normal(), 0.7 * random.Normal() + 0.2);
    b.Sphere(crown + 0.62 * radius * out.normalized(), radius * random.Uniform(0.28, 0.46),
             i % 2 == 0 ? p.leaves : p.dark_leaves);
  }
}

/// Bushes in pots and in the corners; trees and buildings beyond the walls.
void AddGreenAndBeyond(SceneBuilder& b, const CourtyardPalette& p, Random& random) {
  for (const double x : {-10.2, -7.6, -4.6, 4.6, 7.6}) {
    b.Rod({x, 6.1, 0}, {x, 6.1, 0.4}, 0.26, p.clay);
    const double radius = 0.4 + random.Uniform(-0.06, 0.08);
    b.Sphere({x, 6.1, 0.38 + radius * 0.9}, radius, x < 0 ? p.leaves : p.dark_leaves);
  }
  b.Sphere({10.2, 8.1, 0.7}, 0.95, p.leaves);
  b.Sphere({-10.3, 8.2, 0.6}, 0.85, p.dark_leaves);
  for (const auto& [x, y, r] : {std::array{-12.5, 15.0, 2.6},
                                {-15.5, 8.0, 2.4},
                                {3.0, 17.5, 2.8},
                                {14.5, 13.0, 2.7},
                                {16.0, 5.5, 2.2},
                                {-3.5, 15.5, 2.2},
                                {9.5, 20.0, 3.2},
                                {-17.0, -1.0, 2.4}}) {
    AddTree(b, p, {x, y, 0}, r, random);
  }
  b.Box({-7.5, 20, 5}, {2.0, 2.0, 5}, p.plaster, 15);
  b.Slab({-7.5, 18.9, 10.6}, Vector3d(2.5, 0.67, 0), Vector3d(-0.3, 1.1, 0.9), 0.1, p.slate);
  AddHouse(b, {7.0, 15.5, 0}, {3.6, 2.4, 2.6}, 1.9, -12, p.stone, p.slate);
  AddHouse(b, {17.5, 9.5, 0}, {2.4, 2.6, 2.4}, 1.7, 70, p.plaster, p.tiles);
  AddHouse(b, {-18.5, 13.5, 0}, {3.0, 2.6, 2.5}, 1.8, 55, p.brick, p.tiles);
}

}  // namespace

Scene MakeCourtyard(std::uint64_t seed) {
  SceneBuilder b(seed);
  Random random(HashOf(seed, 0xc0u));
  const CourtyardPalette p = MakeCourtyardPalette(b);
  AddWalls(b, p);
  AddArcade(b, p);
  AddHouse(b, {-4.6, 4.3, 0}, {1.2, 1.0, 0.9}, 0.75, 18, p.wood, p.slate);
  AddHouse(b, {6.9, 5.6, 0}, {0.8, 0.7, 0.75}, 0.6, -30, p.brick, p.tiles);
  AddFurnishing(b, p, random);
  AddGreenAndBeyond(b, p, random);
  AddSky(b, 90);
  Framing framing;
  framing.focus = {0, 3.0, 1.3};
  framing.distance = 9;
  framing.height = 0.9;
  framing.max_arc_deg = 92;
  framing.inside = {0.3, -1.2, 1.7};
  framing.inside_radius = 1.0;
  framing.layouts = {"arc", "grid", "line", "inside-out"};
  return std::move(b).Build("courtyard", Daylight(), framing);
}

}  // namespace dtr::datasets
