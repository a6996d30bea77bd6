#include "dtr/types/camera.h"

#include <cmath>
#include <stdexcept>

namespace dtr {

PinholeCamera::PinholeCamera(int width_px, int height_px, double fx_px, double fy_px, double cx_px,
                             double cy_px)
    : width_px_(width_px),
      height_px_(height_px),
      fx_px_(fx_px),
      fy_px_(fy_px),
      cx_px_(cx_px),
      cy_px_(cy_px) {
  if (width_px <= 0 || height_px <= 0) {
    throw std::invalid_argument("PinholeCamera: image size must be positive, found " +
                                std::to_string(width_px) + "x" + std::to_string(height_px));
  }
  if (!(fx_px > 0) || !(fy_px > 0) || !std::isfinite(fx_px) || !std::isfinite(fy_px)) {
    throw std::invalid_argument("PinholeCamera: focal lengths must be positive and finite, found " +
                                std::to_string(fx_px) + ", " + std::to_string(fy_px));
  }
  if (!std::isfinite(cx_px) || !std::isfinite(cy_px)) {
    throw std::invalid_argument("PinholeCamera: the principal point must be finite");
  }
}

Eigen::Vector3d PinholeCamera::CamFromPixel(const Eigen::Vector2d& pixel, double depth,
                                            DepthKind kind) const {
  const Eigen::Vector3d ray = RayFromPixel(pixel);
  return kind == DepthKind::kPlaneZ ? Eigen::Vector3d(ray * depth)
                                    : Eigen::Vector3d(ray * (depth / ray.norm()));
}

PinholeCamera PinholeCamera::Resized(int new_width_px, int new_height_px) const {
  const double sx = static_cast<double>(new_width_px) / width_px_;
  const double sy = static_cast<double>(new_height_px) / height_px_;
  return {new_width_px, new_height_px, fx_px_ * sx, fy_px_ * sy, cx_px_ * sx, cy_px_ * sy};
}

}  // namespace dtr
