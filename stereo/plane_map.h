// stereo/plane_map.h -- a slanted plane per pixel: what views tell each other between passes.
#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "dtr/types/grid.h"

namespace dtr::stereo {

/// Planes of all pixels of a view, linear in inverse depth:
/// unit_z / z (x + dx, y + dy) = inverse_depth + slope_x dx + slope_y dy, dx and dy in pixels from
/// the pixel's centre. Shapes (height, width). Nothing is rejected yet; inverse_depth 0 is a pixel
/// without a plane. Empty grids: the view has no planes at all.
struct PlaneMap {
  Grid<float> inverse_depth, slope_x, slope_y;
  /// Depth in scene units at which inverse_depth is 1. Numbers relative to it round alike whatever
  /// the unit of the world is.
  double unit_z = 1;
  bool empty() const { return inverse_depth.empty(); }
  bool operator==(const PlaneMap&) const = default;
};

/// Where the planes of a collection wait between passes. Any number of threads load and save, each
/// planes of other views.
class PlaneMapStore {
 public:
  virtual ~PlaneMapStore() = default;
  /// True when Save was called for this pass and view, perhaps by an earlier run of the same job.
  virtual bool Has(int pass, int view) const = 0;
  /// Requires Has(pass, view).
  virtual std::shared_ptr<const PlaneMap> Load(int pass, int view) = 0;
  virtual void Save(int pass, int view, PlaneMap&& map) = 0;
  /// Nothing of this pass is wanted any more.
  virtual void Drop(int pass) = 0;
};

/// Keeps everything in memory: 12 bytes per pixel, view and pass.
class PlaneMapsInMemory final : public PlaneMapStore {
 public:
  bool Has(int pass, int view) const override {
    const std::lock_guard lock(mutex_);
    return maps_.contains({pass, view});
  }
  std::shared_ptr<const PlaneMap> Load(int pass, int view) override {
    const std::lock_guard lock(mutex_);
    return maps_.at({pass, view});
  }
  void Save(int pass, int view, PlaneMap&& map) override {
    auto saved = std::make_shared<const PlaneMap>(std::move(map));
    const std::lock_guard lock(mutex_);
    maps_[{pass, view}] = std::move(saved);
  }
  void Drop(int pass) override {
    const std::lock_guard lock(mutex_);
    std::erase_if(maps_, [&](const auto& entry) { return entry.first.first == pass; });
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<int, int>, std::shared_ptr<const PlaneMap>> maps_;
};

}  // namespace dtr::stereo
