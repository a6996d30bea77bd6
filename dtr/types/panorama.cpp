#include "dtr/types/panorama.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace dtr {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

double Radians(double deg) { return deg * std::numbers::pi / 180; }

// Entries are exact where angles are quarters: rotations of a cube's faces have only 0 and 1.
Matrix3d Clean(Matrix3d rotation) {
  for (int i = 0; i < 9; ++i) {
    double& entry = rotation(i / 3, i % 3);
    if (std::abs(entry) < 1e-15) entry = 0;
  }
  return rotation;
}

// A camera that looks `right_deg` to the right of the middle and `up_deg` above the horizon.
Matrix3d Looking(double right_deg, double up_deg) {
  const Matrix3d panorama_from_cam = (AngleAxisd(Radians(right_deg), Vector3d::UnitY()) *
                                      AngleAxisd(Radians(up_deg), Vector3d::UnitX()))
                                         .toRotationMatrix();
  return Clean(panorama_from_cam.transpose());
}

}  // namespace

Eigen::Vector2d Panorama::PixelFromDirection(const Vector3d& direction) const {
  const double longitude = std::atan2(direction.x(), direction.z());
  const double latitude = std::atan2(-direction.y(), std::hypot(direction.x(), direction.z()));
  return {full_width_px * (0.5 + longitude / (2 * std::numbers::pi)) - left_px,
          full_height_px * (0.5 - latitude / std::numbers::pi) - top_px};
}

Vector3d Panorama::DirectionFromPixel(const Eigen::Vector2d& pixel) const {
  const double longitude = 2 * std::numbers::pi * ((pixel.x() + left_px) / full_width_px - 0.5);
  const double latitude = std::numbers::pi * (0.5 - (pixel.y() + top_px) / full_height_px);
  return {std::cos(latitude) * std::sin(longitude), -std::sin(latitude),
          std::cos(latitude) * std::cos(longitude)};
}

std::vector<PanoramaFace> PanoramaFaces() {
  return {{"front", Looking(0, 0)},  {"right", Looking(90, 0)}, {"back", Looking(180, 0)},
          {"left", Looking(270, 0)}, {"up", Looking(0, 90)},    {"down", Looking(0, -90)}};
}

PanoramaFace FaceCalled(const std::string& name) {
  for (PanoramaFace& face : PanoramaFaces()) {
    if (face.name == name) return std::move(face);
  }
  return {"", Matrix3d::Identity()};
}

PinholeCamera FaceCamera(int size_px) {
  return {size_px, size_px, size_px / 2.0, size_px / 2.0, size_px / 2.0, size_px / 2.0};
}

int FaceSizePx(double full_width_px) {
  return std::max(2, 2 * static_cast<int>(std::lround(full_width_px / std::numbers::pi / 2)));
}

}  // namespace dtr
