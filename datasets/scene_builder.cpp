#include "datasets/scene_builder.h"

#include <Eigen/Geometry>
#include <numbers>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/random.h"

namespace dtr::datasets {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Shape = Primitive::Shape;

/// Rows: the local axes in the world. z completes a right-handed frame.
Matrix3d FrameFrom(const Vector3d& x, const Vector3d& y) {
  Matrix3d local_from_world;
  local_from_world.row(0) = x.normalized();
  local_from_world.row(1) = y.normalized();
  local_from_world.row(2) = x.normalized().cross(y.normalized());
  return local_from_world;
}

}  // namespace

int SceneBuilder::Add(Material material) {
  material.seed = static_cast<std::uint32_t>(HashOf(seed_, materials_.size()));
  materials_.push_back(material);
  return static_cast<int>(materials_.size()) - 1;
}

Primitive& SceneBuilder::Box(const Vector3d& center, const Vector3d& half, int material,
                             double turn_deg) {
  Primitive p;
  p.shape = Shape::kBox;
  p.center = center;
  p.half = half;
  p.material = material;
  if (turn_deg != 0) {
    p.local_from_world =
        Eigen::AngleAxisd(-turn_deg * std::numbers::pi / 180, Vector3d::UnitZ()).matrix();
  }
  return primitives_.emplace_back(p);
}

Primitive& SceneBuilder::Sphere(const Vector3d& center, double radius, int material) {
  Primitive p;
  p.shape = Shape::kSphere;
  p.center = center;
  p.half = Vector3d::Constant(radius);
  p.material = material;
  return primitives_.emplace_back(p);
}

Primitive& SceneBuilder::Rod(const Vector3d& from, const Vector3d& to, double radius,
                             int material) {
  Primitive p;
  p.shape = Shape::kCylinder;
  p.center = 0.5 * (from + to);
  p.half = Vector3d(radius, radius, 0.5 * (to - from).norm());
  p.material = material;
  const Vector3d axis = (to - from).normalized();
  if (axis != Vector3d::UnitZ()) {
    p.local_from_world =
        Eigen::Quaterniond::FromTwoVectors(axis, Vector3d::UnitZ()).toRotationMatrix();
  }
  return primitives_.emplace_back(p);
}

Primitive& SceneBuilder::Rectangle(const Vector3d& center, const Vector3d& half_u,
                                   const Vector3d& half_v, int material) {
  Primitive p;
  p.shape = Shape::kRectangle;
  p.center = center;
  p.half = Vector3d(half_u.norm(), half_v.norm(), 0);
  p.local_from_world = FrameFrom(half_u, half_v);
  p.material = material;
  return primitives_.emplace_back(p);
}

Primitive& SceneBuilder::Triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                                  int material) {
  Primitive p;
  p.shape = Shape::kTriangle;
  p.center = a;
  const Vector3d base = b - a;
  const Vector3d rise = (c - a) - base * (base.dot(c - a) / base.squaredNorm());
  p.local_from_world = FrameFrom(base, rise);
  p.half = Vector3d(base.norm(), 0, 0);
  p.apex = (p.local_from_world * (c - a)).head<2>();
  p.material = material;
  return primitives_.emplace_back(p);
}

Primitive& SceneBuilder::Slab(const Vector3d& center, const Vector3d& half_u,
                              const Vector3d& half_v, double half_thickness, int material) {
  Primitive p;
  p.shape = Shape::kBox;
  p.center = center;
  p.half = Vector3d(half_u.norm(), half_v.norm(), half_thickness);
  p.local_from_world = FrameFrom(half_u, half_v);
  p.material = material;
  return primitives_.emplace_back(p);
}

Scene SceneBuilder::Build(std::string name, const Lighting& lighting, const Framing& framing) && {
  return Scene(std::move(name), std::move(primitives_), std::move(materials_), lighting, framing);
}

void AddSky(SceneBuilder& builder, double radius) {
  const int sky = builder.Add({.pattern = Material::Pattern::kSky,
                               .color = {0.30, 0.45, 0.72},
                               .color2 = {0.86, 0.87, 0.88},
                               .shines = true});
  builder.Sphere(Vector3d::Zero(), radius, sky).casts_shadow = false;
}

Lighting Daylight() {
  Lighting light;
  light.source = Vector3d(-0.45, -0.55, 0.75).normalized();
  light.direct = {0.92, 0.86, 0.75};
  light.from_above = {0.34, 0.37, 0.44};
  light.from_below = {0.20, 0.19, 0.17};
  return light;
}

std::vector<std::string> SceneNames() {
  return {"courtyard", "plane", "stairs", "sphere", "room", "plain-room", "toys"};
}

Scene MakeScene(const std::string& name, std::uint64_t seed, double time_s) {
  if (name == "sphere") return MakeSphere(seed, time_s);
  if (name == "toys") return MakeToys(seed, time_s);
  if (time_s != 0) {
    throw UsageError("`time`: expected 0 for " + name +
                     ", where nothing moves; sphere and toys move");
  }
  if (name == "courtyard") return MakeCourtyard(seed);
  if (name == "plane") return MakePlane(seed);
  if (name == "stairs") return MakeStairs(seed);
  if (name == "room") return MakeRoom(seed, false);
  if (name == "plain-room") return MakeRoom(seed, true);
  throw UsageError(
      "scene: expected courtyard, plane, stairs, sphere, room, plain-room or toys, found '" + name +
      "'; see `dtr dataset list`");
}

}  // namespace dtr::datasets
