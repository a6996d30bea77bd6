#include "dtr/types/view.h"

#include <filesystem>
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

bool IsCalled(const std::string& name, const std::string& word) {
  const std::filesystem::path photo(name);
  return name == word || (photo.parent_path() / photo.stem()).string() == word;
}

}  // namespace dtr
