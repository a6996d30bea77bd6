#include "datasets/hard/hard_scenes.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "datasets/scene_builder.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;
using Pattern = Material::Pattern;

constexpr double kFloorHalf = 60;

int Paving(SceneBuilder& builder) {
  return builder.Add({.pattern = Pattern::kPaving,
                      .color = {0.46, 0.43, 0.38},
                      .color2 = {0.13, 0.12, 0.09},
                      .cell = 0.7});
}

void AddFloor(SceneBuilder& builder, int material) {
  builder.Rectangle({0, 0, 0}, kFloorHalf * Vector3d::UnitX(), kFloorHalf * Vector3d::UnitY(),
                    material);
}

int Painting(SceneBuilder& builder, const Vector3d& color, double cell) {
  return builder.Add(
      {.pattern = Pattern::kPainting, .color = color, .cell = cell, .contrast = 0.4});
}

}  // namespace

Scene HardHouse(bool plain_floor) {
  SceneBuilder builder(5);
  const int front = Painting(builder, {0.5, 0.4, 0.3}, 0.9);
  const int side = Painting(builder, {0.3, 0.4, 0.5}, 0.7);
  const int floor = plain_floor ? builder.Add({.pattern = Pattern::kFlat, .color = {0.5, 0.5, 0.5}})
                                : Paving(builder);
  constexpr double kHalf = 2, kHalfHeight = 1.5;
  for (int i = 0; i < 4; ++i) {
    const int material = i % 2 == 0 ? front : side;
    const double turn = i * std::numbers::pi / 2;
    const Vector3d out(std::sin(turn), -std::cos(turn), 0),
        along(std::cos(turn), std::sin(turn), 0);
    builder.Rectangle(kHalf * out + kHalfHeight * Vector3d::UnitZ(), kHalf * along,
                      kHalfHeight * Vector3d::UnitZ(), material);
    builder.Box(kHalf * out + along * 0.9 + Vector3d(0, 0, 1.0), {0.25, 0.25, 0.5}, material,
                i * 90.0);
    builder.Box(kHalf * out - along * 0.8 + Vector3d(0, 0, 1.9), {0.3, 0.2, 0.3}, material,
                i * 90.0);
  }
  AddFloor(builder, floor);
  const int sky =
      builder.Add({.pattern = Pattern::kFlat, .color = {0.6, 0.7, 0.8}, .shines = true});
  builder.Sphere(Vector3d::Zero(), 100, sky).casts_shadow = false;
  // Light from straight above shades equal facades equally.
  Lighting lighting;
  lighting.is_sun = true;
  lighting.source = Vector3d::UnitZ();
  lighting.direct = Vector3d::Constant(0.5);
  lighting.from_above = lighting.from_below = Vector3d::Constant(0.8);
  return std::move(builder).Build("house", lighting, Framing{});
}

Scene HardStreet() {
  SceneBuilder builder(9);
  const int facade = Painting(builder, {0.5, 0.4, 0.3}, 0.9);
  const int wall = builder.Add({.pattern = Pattern::kPlaster,
                                .color = {0.6, 0.5, 0.35},
                                .color2 = {0.3, 0.3, 0.25},
                                .contrast = 0.45});
  const int floor = Paving(builder);
  for (const double x : {-3.5, 3.5}) {
    builder.Rectangle({x, 0, 1.6}, 1.8 * Vector3d::UnitX(), 1.6 * Vector3d::UnitZ(), facade);
    builder.Box({x - 0.9, -0.1, 1.0}, {0.3, 0.3, 0.5}, facade);
    builder.Box({x + 0.8, -0.1, 2.0}, {0.35, 0.2, 0.3}, facade);
  }
  builder.Rectangle({0, 1.5, 2}, 20 * Vector3d::UnitX(), 2 * Vector3d::UnitZ(), wall);
  AddFloor(builder, floor);
  AddSky(builder, 90);
  return std::move(builder).Build("street", Daylight(), Framing{});
}

}  // namespace dtr::datasets
