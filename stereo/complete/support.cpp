#include "stereo/complete/support.h"

#include <cmath>

namespace dtr::stereo {
namespace {

constexpr float kSupportPx = 0.5F;  // cells of disparity
constexpr float kFarPx = 1e-4F;     // what stands for infinitely far, cells of disparity

enum class Says { kNothing, kSameSurface, kOtherSurface };

/// What a view has to say about a point, given before its camera.
Says Ask(const CellView& cells, const CompletedCells& completed, const Eigen::Vector3d& point) {
  const auto at = cells.camera.PixelFromCam(point);
  if (!at || !cells.camera.Contains(*at)) return Says::kNothing;
  const auto w = static_cast<float>(1 / point.z());
  const Eigen::Vector3f ray = cells.RayAt(static_cast<float>(at->x()), static_cast<float>(at->y()));
  const int column = static_cast<int>(at->x()), row = static_cast<int>(at->y());
  const float tolerance = kSupportPx * cells.pixel;
  if (cells.usable(column, row) == 0) return Says::kNothing;
  const float off = completed.PlaneAt(column, row).dot(ray) - w;
  if (std::abs(off) <= tolerance) return Says::kSameSurface;
  return off > 0 ? Says::kNothing : Says::kOtherSurface;  // behind something nearer: not shown
}

}  // namespace

CompletedCells KeepSupported(const CellView& view, const CompletedCells& completed,
                             std::span<const CellView* const> others,
                             std::span<const CompletedCells* const> completed_others) {
  std::vector<Pose> other_from_view;
  for (const CellView* other : others) {
    other_from_view.push_back(other->cam_from_world * view.cam_from_world.Inverse());
  }
  CompletedCells kept = completed;
  for (int y = 0; y < view.colour.height(); ++y) {
    for (int x = 0; x < view.colour.width(); ++x) {
      if (view.inverse_depth(x, y) > 0) continue;
      const Eigen::Vector3f ray = view.RayOf(x, y);
      const float w = std::max(completed.PlaneAt(x, y).dot(ray), kFarPx * view.pixel);
      const Eigen::Vector3d point = (ray / w).cast<double>();
      bool supported = false, contradicted = false;
      for (size_t i = 0; i < others.size() && !supported; ++i) {
        const Says says = Ask(*others[i], *completed_others[i], other_from_view[i] * point);
        supported = says == Says::kSameSurface;
        contradicted = contradicted || says == Says::kOtherSurface;
      }
      if (contradicted && !supported) kept.TakeBack(x, y);
    }
  }
  return kept;
}

}  // namespace dtr::stereo
