// datasets/exact/stereo_scene.h -- textured surfaces with exact depth, for stereo.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "dtr/base/random.h"
#include "stereo/engine.h"

namespace dtr::stereo::testing {

using Eigen::Vector3d;

/// Smooth value noise of one octave at a 3D point, in [0, 1].
inline double Noise(const Vector3d& p) {
  const Vector3d cell = p.array().floor();
  const Vector3d t = p - cell;
  double sum = 0;
  for (int k = 0; k < 8; ++k) {
    double weight = 1;
    std::uint64_t h = 7;
    for (int d = 0; d < 3; ++d) {
      const int up = (k >> d) & 1;
      const double s = t[d] * t[d] * (3 - 2 * t[d]);
      weight *= up ? s : 1 - s;
      h = HashOf(h, static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[d]) + up));
    }
    sum += weight * UniformFromHash(h);
  }
  return sum;
}

/// Multi-octave texture, grey 20..235; `size` is the length of its coarsest detail.
inline double Texture(const Vector3d& p, double size) {
  double value = 0, amplitude = 0.5;
  for (double s = size; amplitude > 0.05; s /= 2, amplitude /= 2) {
    value += amplitude * Noise(p / s + Vector3d::Constant(100 * amplitude));
  }
  return 20 + 215 * std::clamp(1.6 * (value - 0.5) + 0.5, 0.0, 1.0);
}

/// A surface: distance along a ray (origin, direction of z = 1 in its camera) to the first hit.
using Surface = std::function<std::optional<double>(const Vector3d&, const Vector3d&)>;

inline Surface Plane(const Vector3d& normal, double offset) {
  return [=](const Vector3d& o, const Vector3d& d) -> std::optional<double> {
    const double t = (offset - normal.dot(o)) / normal.dot(d);
    return t > 0 && std::isfinite(t) ? std::optional(t) : std::nullopt;
  };
}

inline Surface Sphere(const Vector3d& centre, double radius) {
  return [=](const Vector3d& o, const Vector3d& d) -> std::optional<double> {
    const double a = d.squaredNorm(), b = d.dot(o - centre);
    const double c = (o - centre).squaredNorm() - radius * radius;
    if (b * b < a * c) return std::nullopt;
    const double t = (-b - std::sqrt(b * b - a * c)) / a;
    return t > 0 ? std::optional(t) : std::nullopt;
  };
}

/// The nearest of several surfaces.
inline Surface Union(std::vector<Surface> surfaces) {
  return [=](const Vector3d& o, const Vector3d& d) {
    std::optional<double> nearest;
    for (const Surface& s : surfaces) {
      const auto t = s(o, d);
      if (t && (!nearest || *t < *nearest)) nearest = t;
    }
    return nearest;
  };
}

struct Shot {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
  ImageRgb8 image;
  DepthImage truth;  ///< exact z at pixel centres

  StereoView View() const { return {camera, cam_from_world, &image, nullptr}; }
};

/// Grey value, 0..255, of the point `p` seen along `direction` (world frame).
using Paint = std::function<double(const Vector3d& p, const Vector3d& direction)>;

/// Photographs a painted surface, 2x2 rays per pixel.
inline Shot Photograph(const Surface& surface, const PinholeCamera& camera,
                       const Pose& cam_from_world, const Paint& paint) {
  const int w = camera.width_px(), h = camera.height_px();
  Shot shot{camera, cam_from_world, ImageRgb8(w, h, 3), DepthImage(w, h)};
  const Vector3d origin = cam_from_world.TargetOriginInSource();
  const auto cast = [&](double x, double y) {
    return std::pair(
        surface(origin, cam_from_world.rotation.conjugate() * camera.RayFromPixel({x, y})),
        Vector3d(cam_from_world.rotation.conjugate() * camera.RayFromPixel({x, y})));
  };
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      double grey = 0;
      for (int k = 0; k < 4; ++k) {
        const auto [t, ray] = cast(x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2));
        if (t) grey += 0.25 * paint(origin + *t * ray, ray);
      }
      for (int c = 0; c < 3; ++c) shot.image(x, y, c) = static_cast<std::uint8_t>(grey + 0.5);
      shot.truth(x, y) = static_cast<float>(cast(x + 0.5, y + 0.5).first.value_or(0));
    }
  }
  return shot;
}

/// Photographs a surface with a texture whose coarsest detail has this size.
inline Shot Photograph(const Surface& surface, const PinholeCamera& camera,
                       const Pose& cam_from_world, double texture_size) {
  return Photograph(surface, camera, cam_from_world,
                    [=](const Vector3d& p, const Vector3d&) { return Texture(p, texture_size); });
}

/// A camera at `centre` looking along +z of the world, rolled about its axis.
inline Pose Facing(const Vector3d& centre, double roll_deg = 0) {
  const Eigen::Quaterniond rotation(
      Eigen::AngleAxisd(roll_deg * std::numbers::pi / 180, Vector3d::UnitZ()));
  return {rotation, -(rotation * centre)};
}

}  // namespace dtr::stereo::testing
