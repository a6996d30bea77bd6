#include "dtr/types/depth_image.h"

#include <stdexcept>

namespace dtr {

DepthImage ToPlaneZ(const DepthImage& depth, const PinholeCamera& camera) {
  if (depth.kind() == DepthKind::kPlaneZ) return depth;
  if (depth.width() != camera.width_px() || depth.height() != camera.height_px()) {
    throw std::invalid_argument("ToPlaneZ: the camera must have the size of the depth map");
  }
  DepthImage plane_z(depth.width(), depth.height(), DepthKind::kPlaneZ);
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (DepthImage::IsHole(depth(x, y))) continue;
      const double ray_length = camera.RayFromPixel({x + 0.5, y + 0.5}).norm();
      plane_z(x, y) = static_cast<float>(depth(x, y) / ray_length);
    }
  }
  return plane_z;
}

}  // namespace dtr
