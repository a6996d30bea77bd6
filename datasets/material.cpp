#include "datasets/material.h"

#include <algorithm>
#include <cmath>

#include "datasets/noise.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Pattern = Material::Pattern;

/// Where on a surface a texture is looked up.
struct SurfacePoint {
  Vector2d uv;         ///< on the face, scene units
  Vector3d solid;      ///< in the primitive's frame, shifted by its place so that twins differ
  bool round;          ///< textured in space
  std::uint32_t seed;  ///< of the material and the face
  double footprint;
};

double Noise(const SurfacePoint& s, double wavelength, double gain, std::uint32_t salt) {
  const OctaveNoise noise{wavelength, gain, 10, s.seed + salt};
  return s.round ? Noise3(s.solid, noise, s.footprint) : Noise2(s.uv, noise, s.footprint);
}

/// The cover of fine noise that makes every pattern rich from a metre down to a pixel.
double Grain(const SurfacePoint& s, double contrast) {
  return std::max(0.15, 1.0 + contrast * Noise(s, 0.55, 0.84, 101));
}

Vector3d Mix(const Vector3d& a, const Vector3d& b, double t) { return a + (b - a) * t; }

double SmoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A colour of its own for cell (i, j): `base` brightened or darkened by up to `spread` and tinted.
Vector3d Varied(const Vector3d& base, int i, int j, double spread, std::uint32_t seed) {
  const double light = 1 + spread * LatticeValue(i, j, 1, seed);
  const double warm = 0.3 * spread * LatticeValue(i, j, 2, seed);
  return base.cwiseProduct(Vector3d(light * (1 + warm), light, light * (1 - warm)));
}

Vector3d Plaster(const Material& m, const SurfacePoint& s) {
  const double stain = SmoothStep(-0.1, 0.5, Noise(s, 1.7, 0.6, 7));
  const double speck = SmoothStep(0.45, 0.6, Noise(s, 0.13, 0.5, 31));
  return Mix(Mix(m.color, m.color2, 0.7 * stain), m.color2 * 0.55, 0.6 * speck) *
         Grain(s, m.contrast);
}

Vector3d Brick(const Material& m, const SurfacePoint& s) {
  const double height = m.cell, width = 3.1 * m.cell, joint = 0.09 * m.cell;
  const int row = FloorToInt(s.uv.y() / height);
  const double shifted =
      s.uv.x() + width * (0.5 * (row & 1) + 0.15 * LatticeValue(row, 0, 3, s.seed));
  const int column = FloorToInt(shifted / width);
  const double x = shifted - column * width, y = s.uv.y() - row * height;
  const double edge = std::min(std::min(x, width - x), std::min(y, height - y));
  const Vector3d brick = Varied(m.color, column, row, 0.6, s.seed);
  return (edge < joint ? m.color2 : brick) * Grain(s, m.contrast);
}

Vector3d Paving(const Material& m, const SurfacePoint& s) {
  // Voronoi cells of one jittered point per square; the joint is where two points are as near.
  const Vector2d p = s.uv / m.cell;
  const int i0 = FloorToInt(p.x()), j0 = FloorToInt(p.y());
  double first = 1e9, second = 1e9;
  int ci = 0, cj = 0;
  for (int j = j0 - 1; j <= j0 + 1; ++j) {
    for (int i = i0 - 1; i <= i0 + 1; ++i) {
      const Vector2d point(i + 0.5 + 0.38 * LatticeValue(i, j, 4, s.seed),
                           j + 0.5 + 0.38 * LatticeValue(i, j, 5, s.seed));
      const double distance = (p - point).norm();
      if (distance < first) {
        second = first;
        first = distance;
        ci = i;
        cj = j;
      } else {
        second = std::min(second, distance);
      }
    }
  }
  const Vector3d stone = Varied(m.color, ci, cj, 0.55, s.seed);
  return Mix(m.color2, stone, SmoothStep(0.04, 0.10, second - first)) * Grain(s, m.contrast);
}

Vector3d Planks(const Material& m, const SurfacePoint& s) {
  const int board = FloorToInt(s.uv.x() / m.cell);
  const double length = m.cell * 12;
  const double along = s.uv.y() + length * LatticeUniform(board, 0, 6, s.seed);
  const int piece = FloorToInt(along / length);
  const double x = s.uv.x() - board * m.cell, y = along - piece * length;
  const double edge = std::min(std::min(x, m.cell - x), std::min(y, length - y));
  // Fibres: noise drawn out eightfold along the board; its footprint shrinks with it.
  const OctaveNoise fibre{0.16, 0.75, 7, s.seed + 77u + static_cast<std::uint32_t>(board)};
  const double grain = 1 + m.contrast * Noise2({s.uv.x(), s.uv.y() / 8}, fibre, s.footprint) * 0.8;
  const Vector3d wood = Varied(m.color, board, piece, 0.5, s.seed) * std::max(0.2, grain);
  return (edge < 0.05 * m.cell ? m.color2 : wood) * Grain(s, 0.7 * m.contrast);
}

Vector3d Tiles(const Material& m, const SurfacePoint& s) {
  const int row = FloorToInt(s.uv.y() / m.cell);
  const double width = 0.7 * m.cell;
  const double shifted = s.uv.x() + 0.5 * width * (row & 1);
  const int column = FloorToInt(shifted / width);
  const double x = shifted / width - column, y = s.uv.y() / m.cell - row;
  const double gap = std::min(x, 1 - x) < 0.05 || y < 0.08 ? 0.35 : 1.0;
  return Varied(m.color, column, row, 0.55, s.seed) * gap * (0.75 + 0.35 * y) *
         Grain(s, m.contrast);
}

Vector3d Painting(const Material& m, const SurfacePoint& s) {
  // Patches dropped on top of each other at five scales, each a disc or a turned square.
  Vector3d color = m.color;
  double size = m.cell;
  for (int level = 0; level < 5; ++level, size *= 0.55) {
    if (size < 2 * s.footprint) break;
    const std::uint32_t seed = s.seed + 211u * static_cast<std::uint32_t>(level + 1);
    const Vector2d p = s.uv / size;
    const int i0 = FloorToInt(p.x()), j0 = FloorToInt(p.y());
    for (int j = j0 - 1; j <= j0 + 1; ++j) {
      for (int i = i0 - 1; i <= i0 + 1; ++i) {
        if (LatticeUniform(i, j, 8, seed) > 0.6) continue;
        const Vector2d d =
            p - Vector2d(i + LatticeUniform(i, j, 9, seed), j + LatticeUniform(i, j, 10, seed));
        const double radius = 0.18 + 0.3 * LatticeUniform(i, j, 11, seed);
        const double turn = LatticeValue(i, j, 12, seed);
        const double reach =
            turn > 0 ? d.norm()
                     : std::max(std::abs(d.x() + turn * d.y()), std::abs(d.y() - turn * d.x()));
        if (reach > radius) continue;
        color = Vector3d(LatticeUniform(i, j, 13, seed), LatticeUniform(i, j, 14, seed),
                         LatticeUniform(i, j, 15, seed));
        color = Vector3d::Constant(0.04) + 0.7 * color.cwiseProduct(color);
      }
    }
  }
  return color * Grain(s, m.contrast);
}

Vector3d Marble(const Material& m, const SurfacePoint& s) {
  const double vein = std::abs(Noise(s, 0.9, 0.6, 17)) + 0.5 * std::abs(Noise(s, 0.21, 0.6, 19));
  return Mix(m.color2, m.color, SmoothStep(0.02, 0.5, vein)) * Grain(s, m.contrast);
}

Vector3d Foliage(const Material& m, const SurfacePoint& s) {
  const double leaf = Noise(s, 0.45, 0.82, 23);
  return Mix(m.color2, m.color, SmoothStep(-0.7, 0.8, leaf)) * Grain(s, m.contrast);
}

/// Clouds over hills with woods, by direction; `s.solid` is used as a direction of length 1.
Vector3d Sky(const Material& m, const SurfacePoint& s) {
  const Vector3d d = s.solid.normalized();
  SurfacePoint on_unit = s;
  on_unit.solid = d;
  on_unit.footprint = s.footprint / s.solid.norm();
  on_unit.round = true;
  SurfacePoint around = on_unit;
  around.solid.z() = 0;
  const double skyline = 0.09 + 0.05 * Noise(around, 0.5, 0.6, 3);
  if (d.z() < skyline) {
    const double leaf = Noise(on_unit, 0.06, 0.8, 5);
    const double haze = SmoothStep(-0.05, skyline, d.z());
    return Mix(Vector3d(0.03, 0.06, 0.02), Vector3d(0.2, 0.26, 0.12), SmoothStep(-0.8, 0.9, leaf)) *
               (1 - 0.3 * haze) +
           Vector3d(0.05, 0.06, 0.08) * haze;
  }
  const double cloud = SmoothStep(-0.35, 0.75, Noise(on_unit, 0.35, 0.62, 11));
  return Mix(Mix(m.color, m.color * 0.75, SmoothStep(0.1, 0.8, d.z())), m.color2, cloud);
}

SurfacePoint Locate(const Material& m, const Primitive& primitive, const Vector3d& p_in_world,
                    double footprint) {
  SurfacePoint s;
  const Vector3d p = primitive.ToLocal(p_in_world);
  s.seed = m.seed;
  s.footprint = footprint;
  s.round = primitive.shape == Primitive::Shape::kSphere ||
            primitive.shape == Primitive::Shape::kCylinder;
  // Sharing a material must not mean sharing a texture: shift the lookup by the object's place.
  const Vector3d place =
      m.pattern == Pattern::kSky ? Vector3d::Zero().eval() : (primitive.center * 3.7).eval();
  s.solid = p + place;
  s.uv = p.head<2>();
  if (primitive.shape == Primitive::Shape::kBox) {
    int axis = 0;
    p.cwiseQuotient(primitive.half).cwiseAbs().maxCoeff(&axis);
    // Side faces keep z as the second coordinate, so that courses of bricks run level.
    if (axis == 0) s.uv = Vector2d(p.y(), p.z());
    if (axis == 1) s.uv = Vector2d(p.x(), p.z());
    s.seed += static_cast<std::uint32_t>(2 * axis + (p[axis] > 0 ? 1 : 0)) * 1009u;
  } else if (primitive.shape == Primitive::Shape::kCylinder) {
    s.uv = Vector2d(p.x() + p.y(), p.z());
  }
  s.uv += Vector2d(place.x() + place.y(), place.z() - place.y());
  return s;
}

}  // namespace

Vector3d AlbedoAt(const Material& material, const Primitive& primitive, const Vector3d& p_in_world,
                  double footprint) {
  if (material.pattern == Pattern::kFlat) return material.color;
  const SurfacePoint s = Locate(material, primitive, p_in_world, footprint);
  switch (material.pattern) {
    case Pattern::kFlat:
      break;
    case Pattern::kPlaster:
      return Plaster(material, s);
    case Pattern::kBrick:
      return Brick(material, s);
    case Pattern::kPaving:
      return Paving(material, s);
    case Pattern::kPlanks:
      return Planks(material, s);
    case Pattern::kTiles:
      return Tiles(material, s);
    case Pattern::kPainting:
      return Painting(material, s);
    case Pattern::kMarble:
      return Marble(material, s);
    case Pattern::kFoliage:
      return Foliage(material, s);
    case Pattern::kSky:
      return Sky(material, s);
  }
  return material.color;
}

}  // namespace dtr::datasets
