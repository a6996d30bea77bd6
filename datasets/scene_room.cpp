// datasets/scene_room.cpp -- a closed, furnished room, to be captured from its middle outwards.
#include <numbers>
#include <utility>

#include "datasets/scene_builder.h"
#include "dtr/base/random.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;
using Pattern = Material::Pattern;

constexpr double kHalfX = 4.0, kHalfY = 3.0, kHeight = 2.9;

struct RoomPalette {
  int floor, ceiling, brick, paper, panel, plain, oak, walnut, cloth, rug, painting, leather, leaf,
      clay, metal, marble;
};

RoomPalette MakeRoomPalette(SceneBuilder& b) {
  RoomPalette p;
  p.floor = b.Add({.pattern = Pattern::kPlanks,
                   .color = {0.50, 0.32, 0.18},
                   .color2 = {0.06, 0.04, 0.02},
                   .cell = 0.16,
                   .contrast = 0.45});
  p.ceiling = b.Add({.pattern = Pattern::kPlaster,
                     .color = {0.72, 0.70, 0.66},
                     .color2 = {0.55, 0.52, 0.48},
                     .contrast = 0.3});
  p.brick = b.Add({.pattern = Pattern::kBrick,
                   .color = {0.52, 0.26, 0.18},
                   .color2 = {0.55, 0.52, 0.48},
                   .cell = 0.085,
                   .contrast = 0.42});
  p.paper = b.Add({.pattern = Pattern::kPlaster,
                   .color = {0.42, 0.52, 0.46},
                   .color2 = {0.26, 0.36, 0.34},
                   .contrast = 0.42});
  p.panel = b.Add({.pattern = Pattern::kPlanks,
                   .color = {0.40, 0.29, 0.20},
                   .color2 = {0.05, 0.04, 0.03},
                   .cell = 0.22,
                   .contrast = 0.5});
  p.plain = b.Add({.pattern = Pattern::kPlaster,
                   .color = {0.68, 0.60, 0.46},
                   .color2 = {0.52, 0.44, 0.34},
                   .contrast = 0.36});
  p.oak = b.Add({.pattern = Pattern::kPlanks,
                 .color = {0.58, 0.40, 0.23},
                 .color2 = {0.20, 0.13, 0.07},
                 .cell = 0.3,
                 .contrast = 0.45});
  p.walnut = b.Add({.pattern = Pattern::kPlanks,
                    .color = {0.26, 0.16, 0.10},
                    .color2 = {0.05, 0.03, 0.02},
                    .cell = 0.26,
                    .contrast = 0.5});
  p.cloth = b.Add({.pattern = Pattern::kPlaster,
                   .color = {0.20, 0.29, 0.44},
                   .color2 = {0.12, 0.16, 0.26},
                   .contrast = 0.5});
  p.rug = b.Add(
      {.pattern = Pattern::kPainting, .color = {0.45, 0.12, 0.10}, .cell = 0.42, .contrast = 0.4});
  p.painting = b.Add(
      {.pattern = Pattern::kPainting, .color = {0.55, 0.50, 0.38}, .cell = 0.5, .contrast = 0.25});
  p.leather = b.Add({.pattern = Pattern::kMarble,
                     .color = {0.38, 0.20, 0.11},
                     .color2 = {0.22, 0.10, 0.05},
                     .contrast = 0.4});
  p.leaf = b.Add({.pattern = Pattern::kFoliage,
                  .color = {0.22, 0.40, 0.12},
                  .color2 = {0.03, 0.08, 0.02},
                  .contrast = 0.5});
  p.clay = b.Add({.pattern = Pattern::kMarble,
                  .color = {0.58, 0.32, 0.20},
                  .color2 = {0.36, 0.18, 0.11},
                  .contrast = 0.4});
  p.metal = b.Add({.pattern = Pattern::kPlaster,
                   .color = {0.22, 0.22, 0.24},
                   .color2 = {0.12, 0.11, 0.11},
                   .contrast = 0.4});
  p.marble = b.Add({.pattern = Pattern::kMarble,
                    .color = {0.74, 0.72, 0.68},
                    .color2 = {0.25, 0.26, 0.30},
                    .contrast = 0.35});
  return p;
}

/// Walls and ceiling in one colour each, as walls are painted: light falls on them, and that is all
/// they show.
void PaintPlain(SceneBuilder& b, RoomPalette& p) {
  p.ceiling = b.Add({.pattern = Pattern::kFlat, .color = {0.72, 0.70, 0.66}});
  p.plain = p.brick = p.paper = b.Add({.pattern = Pattern::kFlat, .color = {0.62, 0.58, 0.50}});
}

/// Floor, ceiling with beams, four walls of different stuff, skirting boards, window and door.
void AddShell(SceneBuilder& b, const RoomPalette& p) {
  const Vector3d x = kHalfX * Vector3d::UnitX(), y = kHalfY * Vector3d::UnitY(),
                 z = kHeight / 2 * Vector3d::UnitZ();
  b.Rectangle({0, 0, 0}, x, y, p.floor);
  b.Rectangle({0, 0, kHeight}, x, y, p.ceiling);
  b.Rectangle({0, kHalfY, kHeight / 2}, x, z, p.brick);
  b.Rectangle({0, -kHalfY, kHeight / 2}, x, z, p.panel);
  b.Rectangle({-kHalfX, 0, kHeight / 2}, y, z, p.paper);
  b.Rectangle({kHalfX, 0, kHeight / 2}, y, z, p.plain);
  for (int i = 0; i < 5; ++i) {
    b.Box({-3.2 + 1.6 * i, 0, kHeight - 0.08}, {0.09, kHalfY, 0.08}, p.walnut);
  }
  for (const double side : {-1.0, 1.0}) {
    b.Box({side * (kHalfX - 0.01), 0, 0.06}, {0.02, kHalfY, 0.06}, p.walnut);
    b.Box({0, side * (kHalfY - 0.01), 0.06}, {kHalfX, 0.02, 0.06}, p.walnut);
  }
  // Window in the right wall, shut with a painted screen; door in the panelled wall.
  b.Box({kHalfX - 0.03, 0.2, 1.6}, {0.05, 0.85, 0.65}, p.oak);
  b.Box({kHalfX - 0.07, 0.2, 1.6}, {0.03, 0.76, 0.56}, p.painting);
  b.Box({kHalfX - 0.10, 0.2, 1.6}, {0.03, 0.025, 0.6}, p.oak);
  b.Box({kHalfX - 0.12, 0.2, 0.92}, {0.14, 0.95, 0.025}, p.marble);
  b.Box({2.4, -kHalfY + 0.04, 1.02}, {0.46, 0.05, 1.02}, p.oak);
  b.Sphere({2.06, -kHalfY + 0.14, 1.0}, 0.04, p.metal);
}

/// A bookcase of 5 shelves against the wall y = +3, filled with books of all sizes.
void AddBookcase(SceneBuilder& b, const RoomPalette& p, double x0, Random& random) {
  constexpr double kHalfWidth = 0.75, kDepth = 0.16, kTop = 2.05;
  const double y = kHalfY - kDepth;
  b.Box({x0 - kHalfWidth, y, kTop / 2}, {0.025, kDepth, kTop / 2}, p.walnut);
  b.Box({x0 + kHalfWidth, y, kTop / 2}, {0.025, kDepth, kTop / 2}, p.walnut);
  for (int shelf = 0; shelf <= 5; ++shelf) {
    const double z = 0.04 + 0.4 * shelf;
    b.Box({x0, y, z}, {kHalfWidth, kDepth, 0.02}, p.walnut);
    if (shelf == 5) break;
    double x = x0 - kHalfWidth + 0.05;
    while (x < x0 + kHalfWidth - 0.12) {
      const double half_width = random.Uniform(0.015, 0.045);
      const double half_height = random.Uniform(0.10, 0.165);
      const int covers[] = {p.leather, p.cloth, p.painting, p.rug, p.clay, p.paper};
      const int cover = covers[random.Index(6)];
      x += half_width;
      if (random.Uniform() < 0.88) {
        b.Box({x, y - random.Uniform(0, 0.04), z + 0.02 + half_height},
              {half_width, 0.11, half_height}, cover);
      }
      x += half_width + 0.004;
    }
  }
}

void AddChair(SceneBuilder& b, const RoomPalette& p, const Vector3d& foot, double turn_deg) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(turn_deg * std::numbers::pi / 180, Vector3d::UnitZ()).matrix();
  const auto at = [&](double x, double y, double z) -> Vector3d {
    return foot + turn * Vector3d(x, y, z);
  };
  b.Box(at(0, 0, 0.45), {0.22, 0.22, 0.025}, p.leather, turn_deg);
  for (const double x : {-0.19, 0.19}) {
    b.Rod(at(x, -0.19, 0), at(x, -0.19, 0.43), 0.02, p.walnut);
    b.Rod(at(x, 0.19, 0), at(x, 0.24, 0.98), 0.02, p.walnut);
  }
  b.Slab(at(0, 0.235, 0.82), turn * Vector3d(0.2, 0, 0), turn * Vector3d(0, 0.012, 0.13), 0.012,
         p.walnut);
}

/// Table, chairs and rug in the middle; low enough for cameras at eye height to look over.
void AddMiddle(SceneBuilder& b, const RoomPalette& p, Random& random) {
  b.Box({0, 0, 0.008}, {1.7, 1.25, 0.008}, p.rug, 7);
  b.Rod({0, 0, 0.70}, {0, 0, 0.75}, 0.62, p.oak);
  b.Rod({0, 0, 0}, {0, 0, 0.70}, 0.07, p.walnut);
  b.Sphere({0.22, 0.12, 0.83}, 0.09, p.clay);
  b.Box({-0.2, 0.15, 0.78}, {0.14, 0.10, 0.03}, p.painting, 20);
  b.Box({-0.18, 0.16, 0.83}, {0.11, 0.08, 0.02}, p.cloth, -12);
  b.Rod({0.05, -0.28, 0.75}, {0.05, -0.28, 0.86}, 0.045, p.marble);
  for (int i = 0; i < 3; ++i) {
    const double angle = 2.2 + 2 * std::numbers::pi * i / 3 + random.Uniform(-0.2, 0.2);
    AddChair(b, p, {0.95 * std::cos(angle), 0.95 * std::sin(angle), 0},
             angle * 180 / std::numbers::pi - 90);
  }
}

/// What stands against the walls.
void AddAlongWalls(SceneBuilder& b, const RoomPalette& p) {
  // Sofa under images, left wall.
  b.Box({-3.45, 0.1, 0.22}, {0.42, 1.0, 0.22}, p.cloth);
  b.Box({-3.80, 0.1, 0.62}, {0.12, 1.0, 0.3}, p.cloth);
  b.Box({-3.45, 1.2, 0.35}, {0.42, 0.1, 0.35}, p.cloth);
  b.Box({-3.45, -1.0, 0.35}, {0.42, 0.1, 0.35}, p.cloth);
  b.Slab({-3.55, 0.7, 0.66}, Vector3d(0, 0.22, 0), Vector3d(-0.09, 0, 0.2), 0.06, p.rug);
  b.Slab({-3.55, -0.45, 0.64}, Vector3d(0.05, 0.2, 0), Vector3d(-0.08, 0.02, 0.2), 0.06,
         p.painting);
  b.Box({-3.97, 0.75, 1.75}, {0.025, 0.42, 0.32}, p.painting);
  b.Box({-3.97, -0.35, 1.8}, {0.025, 0.3, 0.4}, p.painting);
  b.Box({-3.97, -1.9, 1.6}, {0.025, 0.35, 0.25}, p.rug);
  // Sideboard with a globe, vases and a leaning image, wall y = -3.
  b.Box({-1.0, -2.75, 0.42}, {1.1, 0.22, 0.42}, p.oak);
  for (int i = 0; i < 3; ++i) b.Box({-1.7 + 0.7 * i, -2.52, 0.45}, {0.3, 0.015, 0.3}, p.walnut);
  b.Sphere({-1.6, -2.72, 1.06}, 0.2, p.painting);
  b.Rod({-0.95, -2.75, 0.84}, {-0.95, -2.75, 1.2}, 0.09, p.clay);
  b.Sphere({-0.95, -2.75, 1.35}, 0.2, p.leaf);
  b.Slab({-0.3, -2.84, 1.14}, Vector3d(0.3, 0, 0), Vector3d(0, -0.06, 0.29), 0.015, p.painting);
  b.Box({-1.2, -2.975, 1.95}, {0.5, 0.025, 0.34}, p.painting);
  b.Box({0.75, -2.975, 1.75}, {0.28, 0.025, 0.38}, p.rug);
  // Radiator of thin rods under the window, plant and standing lamp in the corners.
  for (int i = 0; i < 11; ++i) {
    const double y = -0.5 + 0.14 * i;
    b.Rod({3.86, y, 0.15}, {3.86, y, 0.75}, 0.022, p.metal);
  }
  b.Box({3.86, 0.2, 0.72}, {0.04, 0.78, 0.03}, p.metal);
  b.Box({3.86, 0.2, 0.18}, {0.04, 0.78, 0.03}, p.metal);
  b.Rod({3.3, 2.35, 0}, {3.3, 2.35, 0.45}, 0.24, p.clay);
  b.Sphere({3.3, 2.35, 0.95}, 0.45, p.leaf);
  b.Sphere({3.05, 2.2, 1.45}, 0.3, p.leaf);
  b.Rod({-3.4, 2.4, 0}, {-3.4, 2.4, 1.6}, 0.018, p.metal);
  b.Rod({-3.4, 2.4, 1.5}, {-3.4, 2.4, 1.8}, 0.22, p.plain);
  b.Box({3.5, -1.6, 0.5}, {0.35, 0.5, 0.5}, p.walnut);
  b.Box({3.5, -1.75, 1.1}, {0.18, 0.22, 0.1}, p.oak, 15);
  b.Rod({3.45, -1.3, 1.0}, {3.45, -1.3, 1.3}, 0.08, p.marble);
  b.Slab({1.55, 2.8, 0.95}, Vector3d(0.5, 0, 0), Vector3d(0, 0.15, 0.92), 0.03, p.painting);
  b.Box({-3.0, -2.6, 0.3}, {0.3, 0.3, 0.3}, p.leather, 20);
}

}  // namespace

Scene MakeRoom(std::uint64_t seed, bool plain) {
  SceneBuilder b(seed);
  Random random(HashOf(seed, 0x20u));
  RoomPalette p = MakeRoomPalette(b);
  if (plain) PaintPlain(b, p);
  AddShell(b, p);
  AddBookcase(b, p, -1.9, random);
  AddBookcase(b, p, -0.3, random);
  AddMiddle(b, p, random);
  AddAlongWalls(b, p);
  Lighting light;
  light.is_sun = false;
  light.source = {0.3, 0.2, 2.6};
  light.lamp_reach = 2.2;
  light.direct = {0.62, 0.57, 0.48};
  light.from_above = {0.34, 0.34, 0.36};
  light.from_below = {0.30, 0.28, 0.25};
  Framing framing;
  framing.focus = {0, 0, 0.9};
  framing.height = 0.65;
  framing.distance = 2.1;
  framing.ring_radius = 2.1;
  framing.inside = {0, 0, 1.5};
  framing.inside_radius = 0.7;
  framing.layouts = {"inside-out", "ring"};
  return std::move(b).Build(plain ? "plain-room" : "room", light, framing);
}

}  // namespace dtr::datasets
