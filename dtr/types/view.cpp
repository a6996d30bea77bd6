#include "dtr/types/view.h"

#include <stdexcept>

namespace dtr {

const char* NameOf(ViewRole role) { return role == ViewRole::kSource ? "source" : "held_out"; }

PinholeCamera View::DepthCamera() const {
  if (depth_scale == 1) return camera;
  if (depth_scale < 1 || camera.width_px() % depth_scale != 0 ||
      camera.height_px() % depth_scale != 0) {
    throw std::invalid_argument("View::DepthCamera: the depth scale must divide the image's size");
  }
  return camera.Resized(camera.width_px() / depth_scale, camera.height_px() / depth_scale);
}

}  // namespace dtr
