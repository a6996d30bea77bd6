// stereo/view_paging.h -- what work on one view needs in memory, and nothing else.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "stereo/engine.h"
#include "stereo/pages.h"
#include "stereo/plane_map.h"

namespace dtr::stereo {

/// What StereoView borrows.
struct StereoPixels {
  ImageRgb8 image;
  Mask mask;
};
/// Reads a view's pixels; called from several threads, for other views each.
using PixelLoader = std::function<StereoPixels(int view)>;

/// Where unfiltered depth maps wait until their neighbours are done. Any number of threads load and
/// save, each maps of other views.
class EstimateStore {
 public:
  virtual ~EstimateStore() = default;
  virtual bool Has(int view) const = 0;
  /// Requires Has(view).
  virtual std::shared_ptr<const DepthEstimate> Load(int view) = 0;
  virtual void Save(int view, DepthEstimate&& estimate) = 0;
  virtual void Drop(int view) = 0;
};

class EstimatesInMemory final : public EstimateStore {
 public:
  bool Has(int view) const override {
    const std::lock_guard lock(mutex_);
    return estimates_.contains(view);
  }
  std::shared_ptr<const DepthEstimate> Load(int view) override {
    const std::lock_guard lock(mutex_);
    return estimates_.at(view);
  }
  void Save(int view, DepthEstimate&& estimate) override {
    auto saved = std::make_shared<const DepthEstimate>(std::move(estimate));
    const std::lock_guard lock(mutex_);
    estimates_[view] = std::move(saved);
  }
  void Drop(int view) override {
    const std::lock_guard lock(mutex_);
    estimates_.erase(view);
  }

 private:
  mutable std::mutex mutex_;
  std::map<int, std::shared_ptr<const DepthEstimate>> estimates_;
};

/// A store whose loaded planes stay in `pages` as long as there is room.
class PagedPlanes final : public PlaneMapStore {
 public:
  PagedPlanes(PlaneMapStore& store, Pages& pages, std::span<const StereoView> views)
      : store_(store), pages_(pages), views_(views) {}
  bool Has(int pass, int view) const override { return store_.Has(pass, view); }
  std::shared_ptr<const PlaneMap> Load(int pass, int view) override;
  void Save(int pass, int view, PlaneMap&& map) override {
    store_.Save(pass, view, std::move(map));
  }
  void Drop(int pass) override;

 private:
  PlaneMapStore& store_;
  Pages& pages_;
  std::span<const StereoView> views_;
};

/// The same for unfiltered depth maps.
class PagedEstimates final : public EstimateStore {
 public:
  PagedEstimates(EstimateStore& store, Pages& pages, std::span<const StereoView> views)
      : store_(store), pages_(pages), views_(views) {}
  bool Has(int view) const override { return store_.Has(view); }
  std::shared_ptr<const DepthEstimate> Load(int view) override;
  void Save(int view, DepthEstimate&& estimate) override { store_.Save(view, std::move(estimate)); }
  void Drop(int view) override;

 private:
  EstimateStore& store_;
  Pages& pages_;
  std::span<const StereoView> views_;
};

/// All views of a collection, those that work on one of them needs with their pixels in memory as
/// long as this lives.
class ViewsAround {
 public:
  /// Without a loader the views have their pixels already.
  ViewsAround(std::span<const StereoView> views, const PixelLoader& load, Pages& pages, int view,
              std::span<const int> neighbours);
  std::span<const StereoView> views() const { return views_; }

 private:
  std::vector<std::shared_ptr<const StereoPixels>> held_;
  std::vector<StereoView> copies_;
  std::span<const StereoView> views_;
};

/// A final map is there twice while it is written.
inline constexpr std::uint64_t kResultCopies = 2;

/// Bytes of what is paged, for a view of this camera.
std::uint64_t PixelBytes(const PinholeCamera& camera);
std::uint64_t PlaneBytes(const PinholeCamera& camera);
std::uint64_t EstimateBytes(const PinholeCamera& camera);

/// What filtering a view takes of what is known of it otherwise: its prior, its time step.
std::uint64_t OtherBytes(const StereoView& view);

/// The least room in which an engine can work on a view: the largest of its steps, with everything
/// that the step needs at the same time.
std::uint64_t LeastBytes(std::span<const StereoView> views, const Engine& engine, int view,
                         std::span<const int> neighbours, bool pixels_are_paged, bool filters);

}  // namespace dtr::stereo
