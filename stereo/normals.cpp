#include "stereo/normals.h"

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>

namespace dtr::stereo {
namespace {

constexpr double kMaxSigmas = 2;

}  // namespace

Grid<float> NormalsOf(const PlaneMap& planes, const DepthImage& depth, const Grid<float>& sigma,
                      const PinholeCamera& camera) {
  const int width = camera.width_px(), height = camera.height_px();
  if (depth.width() != width || depth.height() != height || sigma.width() != width ||
      sigma.height() != height ||
      (!planes.empty() &&
       (planes.inverse_depth.width() != width || planes.inverse_depth.height() != height))) {
    throw std::invalid_argument("NormalsOf: planes, depth, sigma and camera must have one size");
  }
  Grid<float> normals(width, height, 3);
  if (planes.empty()) return normals;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (DepthImage::IsHole(depth(x, y))) continue;
      const double w = planes.inverse_depth(x, y);
      const double off = w / planes.unit_z - 1.0 / depth(x, y);
      if (!(std::abs(off) <= kMaxSigmas * sigma(x, y))) continue;
      // unit_z / z = n . (X / Z, Y / Z, 1), so n . (X, Y, Z) = unit_z: n points away.
      const double across = planes.slope_x(x, y) * camera.fx_px();
      const double down = planes.slope_y(x, y) * camera.fy_px();
      const Eigen::Vector2d ray((x + 0.5 - camera.cx_px()) / camera.fx_px(),
                                (y + 0.5 - camera.cy_px()) / camera.fy_px());
      const Eigen::Vector3d n(across, down, w - across * ray.x() - down * ray.y());
      const Eigen::Vector3f facing = -n.normalized().cast<float>();
      for (int c = 0; c < 3; ++c) normals(x, y, c) = facing[c];
    }
  }
  return normals;
}

}  // namespace dtr::stereo
