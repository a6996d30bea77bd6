// tests/eval/plane_views.h -- views of a slanted plane with exact depth, and a box before it.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <string>

#include "dtr/types/view.h"

namespace dtr::eval::testing {

/// World: the plane z = 10 + 0.2 x, and in front of it the square |x|, |y| < 1 at z = 6.
/// Depth along the ray from `center` in `direction`, or infinity.
inline double CastRay(const Eigen::Vector3d& center, const Eigen::Vector3d& direction,
                      bool with_square) {
  double t = (10 + 0.2 * center.x() - center.z()) / (direction.z() - 0.2 * direction.x());
  if (!(t > 0)) t = std::numeric_limits<double>::infinity();
  if (with_square && direction.z() > 0) {
    const double front = (6 - center.z()) / direction.z();
    const Eigen::Vector3d hit = center + front * direction;
    if (front > 0 && front < t && std::abs(hit.x()) < 1 && std::abs(hit.y()) < 1) t = front;
  }
  return t;
}

/// A camera at (x, 0, 0), turned by `yaw_rad` about its own y axis, 80x60 pixels, depth 1/s.
inline View PlaneView(double x, double yaw_rad, bool with_square, int depth_scale = 1) {
  View view;
  view.name = view.id = "view" + std::to_string(x);
  view.camera = PinholeCamera(80, 60, 90, 88, 41, 29);
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY()));
  view.cam_from_world = {rotation, -(rotation * Eigen::Vector3d(x, 0, 0))};
  view.depth_scale = depth_scale;
  const PinholeCamera grid = view.DepthCamera();
  view.depth = DepthImage(grid.width_px(), grid.height_px());
  view.image = ImageRgb8(80, 60, 3, 120);
  for (int v = 0; v < grid.height_px(); ++v) {
    for (int u = 0; u < grid.width_px(); ++u) {
      const Eigen::Vector3d ray = rotation.conjugate() * grid.RayFromPixel({u + 0.5, v + 0.5});
      const double z = CastRay(view.CenterInWorld(), ray, with_square);  // the ray has cam z = 1
      if (std::isfinite(z)) view.depth(u, v) = static_cast<float>(z);
    }
  }
  return view;
}

}  // namespace dtr::eval::testing
