// datasets/exact/analytic_scene.h -- views of simple shapes with exact depth and a smooth texture.
#pragma once
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "dtr/types/dtr_set.h"

namespace dtr::testing {

/// Distance along `direction` (world, any length) from `origin` to the surface in units of the
/// direction's length; infinity where nothing is hit. Only hits in front count.
using Surface =
    std::function<double(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;

inline constexpr double kNoHit = std::numeric_limits<double>::infinity();

/// The plane n . p = distance.
inline Surface Plane(const Eigen::Vector3d& normal, double distance) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const double along = normal.dot(d);
    const double t = (distance - normal.dot(o)) / along;
    return along != 0 && t > 0 ? t : kNoHit;
  };
}

/// A square of side 2 `half` at z, facing -z, centred on (x, y).
inline Surface Square(double x, double y, double z, double half) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const double t = (z - o.z()) / d.z();
    if (!(d.z() != 0 && t > 0)) return kNoHit;
    const Eigen::Vector3d p = o + t * d;
    return std::abs(p.x() - x) <= half && std::abs(p.y() - y) <= half ? t : kNoHit;
  };
}

inline Surface Sphere(const Eigen::Vector3d& center, double radius) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const double a = d.squaredNorm(), b = d.dot(o - center);
    const double c = (o - center).squaredNorm() - radius * radius;
    const double discriminant = b * b - a * c;
    if (discriminant < 0) return kNoHit;
    const double t = (-b - std::sqrt(discriminant)) / a;
    return t > 0 ? t : kNoHit;
  };
}

inline Surface Union(Surface first, Surface second) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    return std::min(first(o, d), second(o, d));
  };
}

/// Smooth colour of a world point, 8-bit sRGB before rounding; `period` in scene units.
inline Eigen::Vector3d SmoothColour(const Eigen::Vector3d& p, double period) {
  const double k = 2 * 3.14159265358979323846 / period;
  return {128 + 60 * std::sin(k * p.x()) + 30 * std::sin(k * p.z()),
          128 + 60 * std::sin(k * p.y() + 1) + 30 * std::cos(k * p.x()),
          128 + 50 * std::sin(k * (p.x() + p.y()) + 2)};
}

/// Camera at `center` that looks at `target`; the world's y axis is down.
inline Pose LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d(0, 1, 0).cross(z).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(cam_from_world).normalized();
  return {rotation, -(rotation * center)};
}

struct Shot {
  std::string id = "view";
  PinholeCamera camera{96, 72, 100, 100, 48, 36};
  Pose cam_from_world;
  int depth_scale = 1;
  double texture_period = 4;  ///< scene units
};

/// A source view of the surface: point-sampled colour and depth at pixel centres.
inline View Photograph(const Surface& surface, const Shot& shot) {
  View view;
  view.id = view.name = shot.id;
  view.camera = shot.camera;
  view.cam_from_world = shot.cam_from_world;
  view.depth_scale = shot.depth_scale;
  view.image = ImageRgb8(shot.camera.width_px(), shot.camera.height_px(), 3);
  const Pose world_from_cam = shot.cam_from_world.Inverse();
  const auto depth_at = [&](const PinholeCamera& camera, int x, int y, Eigen::Vector3d* point) {
    const Eigen::Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
    const Eigen::Vector3d direction = world_from_cam.rotation * ray;
    const double t = surface(world_from_cam.translation, direction);
    if (point != nullptr && t < kNoHit) *point = world_from_cam.translation + t * direction;
    return t < kNoHit ? t : 0.0;
  };
  for (int y = 0; y < view.image.height(); ++y) {
    for (int x = 0; x < view.image.width(); ++x) {
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      if (!(depth_at(view.camera, x, y, &point) > 0)) continue;
      const Eigen::Vector3d colour = SmoothColour(point, shot.texture_period);
      for (int c = 0; c < 3; ++c) {
        view.image(x, y, c) = static_cast<std::uint8_t>(std::lround(colour[c]));
      }
    }
  }
  const PinholeCamera depth_camera = view.DepthCamera();
  view.depth = DepthImage(depth_camera.width_px(), depth_camera.height_px());
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) {
      view.depth(x, y) = static_cast<float>(depth_at(depth_camera, x, y, nullptr));
    }
  }
  return view;
}

}  // namespace dtr::testing
