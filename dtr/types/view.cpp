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

DepthImage MeasuredDepth(const View& view) {
  DepthImage measured = view.depth;
  for (size_t p = 0; p < view.depth_state.data().size(); ++p) {
    if (view.depth_state.data()[p] != DepthState::kMeasured) measured.grid().data()[p] = 0;
  }
  return measured;
}

DepthImage CompletedDepth(const View& view) {
  if (view.depth_state.empty()) return {};
  DepthImage completed(view.depth.width(), view.depth.height());
  for (size_t p = 0; p < view.depth_state.data().size(); ++p) {
    if (view.depth_state.data()[p] == DepthState::kMeasured) continue;
    completed.grid().data()[p] = view.depth.grid().data()[p];
  }
  return completed;
}

void AddCompletedDepth(const DepthImage& completed, View& view) {
  if (completed.empty()) return;
  view.depth_state = Grid<DepthState>(view.depth.width(), view.depth.height());
  const auto far = static_cast<float>(view.completed_far_z);
  for (size_t p = 0; p < view.depth_state.data().size(); ++p) {
    const float z = completed.grid().data()[p];
    float& depth = view.depth.grid().data()[p];
    if (DepthImage::IsHole(z) || !DepthImage::IsHole(depth)) continue;
    depth = z;
    view.depth_state.data()[p] = z < far ? DepthState::kCompleted : DepthState::kFar;
  }
}

std::vector<const StoredFile*> StoredFilesOf(const View& view) {
  std::vector<const StoredFile*> files;
  for (const auto* file :
       {&view.image_file, &view.mask_file, &view.depth_file, &view.depth_base, &view.completed_file,
        &view.completed_base, &view.sigma_file, &view.sigma_base, &view.mesh_file}) {
    if (*file) files.push_back(&**file);
  }
  return files;
}

void DropDepth(View& view) {
  view.depth = {};
  view.depth_state = {};
  view.inverse_depth_sigma.reset();
  view.mesh.reset();
  for (auto* file : {&view.depth_file, &view.completed_file, &view.sigma_file, &view.mesh_file,
                     &view.depth_base, &view.completed_base, &view.sigma_base}) {
    file->reset();
  }
  view.near_z = view.far_z = view.completed_near_z = view.completed_far_z = 0;
  view.completed_steps = 0;
  view.depth_scale = 1;
}

bool IsCalled(const std::string& name, const std::string& word) {
  const std::filesystem::path photo(name);
  return name == word || (photo.parent_path() / photo.stem()).string() == word;
}

}  // namespace dtr
