#include "dtr/render/free_space.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "dtr/base/order_statistics.h"

namespace dtr {
namespace {

constexpr size_t kMaxViews = 64;
constexpr int kStep = 4;            // a camera is larger than four pixels of a photo
constexpr double kClearance = 0.2;  // of the depth of the surface behind a position
// Of the views that look at a position: fewer that see past it may be wrong depth. An object
// between it and the others leaves some.
constexpr double kLeastShare = 0.2;
constexpr int kStepsOfLine = 16;

}  // namespace

FreeSpace::Surfaces FreeSpace::SurfacesOf(const View& view) {
  const DepthImage& depth = view.depth;
  Surfaces surfaces{
      view.DepthCamera(), view.cam_from_world,
      Grid<float>((depth.width() + kStep - 1) / kStep, (depth.height() + kStep - 1) / kStep), 0};
  std::vector<float> found;
  for (int y = 0; y < depth.height(); y += kStep) {
    for (int x = 0; x < depth.width(); x += kStep) {
      const bool far = !view.depth_state.empty() && view.depth_state(x, y) == DepthState::kFar;
      const float z = far ? std::numeric_limits<float>::infinity() : depth(x, y);
      surfaces.z(x / kStep, y / kStep) = z;
      if (z > 0 && !far) found.push_back(z);
    }
  }
  if (!found.empty()) surfaces.median_z = UpperMedian(found);
  return surfaces;
}

FreeSpace::FreeSpace(std::span<const View* const> views, double near, const DepthLoader& load)
    : near_(near) {
  for (const View* view : views) centers_.push_back(view->CenterInWorld());
  const size_t count = std::min(views.size(), kMaxViews);
  for (size_t i = 0; i < count; ++i) {
    const View* view = views[i * views.size() / count];
    View loaded;
    if (view->depth.empty() && load) {
      loaded = *view;
      load(loaded);
      view = &loaded;
    }
    if (!view->depth.empty()) seen_.push_back(SurfacesOf(*view));
  }
}

bool FreeSpace::Has(const Eigen::Vector3d& position_in_world) const {
  for (const Eigen::Vector3d& center : centers_) {
    if ((position_in_world - center).norm() <= near_) return true;
  }
  int looking = 0, past = 0;
  for (const Surfaces& view : seen_) {
    const Eigen::Vector3d in_cam = view.cam_from_world * position_in_world;
    const std::optional<Eigen::Vector2d> pixel = view.camera.PixelFromCam(in_cam);
    if (!pixel || !view.camera.Contains(*pixel)) continue;
    const float z =
        view.z(static_cast<int>(pixel->x()) / kStep, static_cast<int>(pixel->y()) / kStep);
    if (!(z > 0)) continue;
    ++looking;
    past += in_cam.z() < (1 - kClearance) * z;
  }
  return past >= kLeastShare * looking;
}

bool FreeSpace::HasLine(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  for (int i = 1; i < kStepsOfLine; ++i) {
    if (!Has(from + (to - from) * i / kStepsOfLine)) return false;
  }
  return true;
}

double FreeSpace::SceneZ(const Eigen::Vector3d& position_in_world) const {
  double z = 0, nearest = std::numeric_limits<double>::infinity();
  for (const Surfaces& view : seen_) {
    const double distance = (view.cam_from_world.TargetOriginInSource() - position_in_world).norm();
    if (view.median_z > 0 && distance < nearest) {
      nearest = distance;
      z = view.median_z;
    }
  }
  return z;
}

}  // namespace dtr
