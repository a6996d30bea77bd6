// stereo/depth_maps.h -- depth maps of a whole collection: neighbours, ranges, engine, filter.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "dtr/base/progress.h"
#include "stereo/consistency.h"
#include "stereo/depth_range.h"
#include "stereo/engine.h"
#include "stereo/neighbours.h"
#include "stereo/view_paging.h"

namespace dtr::stereo {

struct DepthMapsOptions {
  NeighbourOptions neighbours;
  DepthRangeOptions range;
  std::vector<DepthRange> given_ranges;  ///< one per view; empty: from the sparse points
  int widenings = 0;  ///< ends of ranges that prove too narrow move out so often at most (Widened)
  ConsistencyOptions consistency;
  EngineOptions engine;
  /// Where planes wait between the passes of engines that have any, so that an interrupted run can
  /// go on from there; null: in memory, 24 bytes per pixel and view. Borrowed.
  PlaneMapStore* planes = nullptr;
  bool has_passes = false;  ///< `planes` has all of them (ComputeDepthPass), else it is an Error
  /// Where unfiltered depth maps wait for their neighbours'; null: in memory. Borrowed.
  EstimateStore* estimates = nullptr;
  /// Reads the pixels of views that do not have them in memory; null: all have.
  PixelLoader load_pixels;
  /// What pixels, planes, unfiltered maps and the engine's work may take together; what was loaded
  /// stays as long as there is room. 0: no limit. Needs both stores; without `load_pixels` the
  /// views' own pixels come on top. No effect on the result.
  std::uint64_t memory_bytes = 0;
};

/// The limit is too low for a single view with its neighbours.
class NotEnoughMemory : public Error {
 public:
  NotEnoughMemory(const std::string& message, std::uint64_t min_bytes)
      : Error(message), min_bytes_(min_bytes) {}
  /// The least limit that works.
  std::uint64_t min_bytes() const { return min_bytes_; }

 private:
  std::uint64_t min_bytes_;
};

/// Computes the depth map of every view for which `already_done(view)` is false and hands it to
/// `on_view` as soon as it is final: in rising order of views, but for those that become so at the
/// same time, which are handed out side by side, from several threads. A view
/// whose neighbours are not done depends on their unfiltered maps too; those are computed even if
/// the neighbours' own results are done, so a resumed run gives the same bytes as an undisturbed
/// one. With an engine that has passes, all views go through one pass before the next begins (see
/// RunAllPasses), and maps are handed out after the last. A view without neighbours, or for which
/// the engine finds no usable pair, gets a map of holes and a note. Throws what the engine throws,
/// Error when a depth range is unknown, Interrupted between views, NotEnoughMemory before
/// any work, UsageError when `given_ranges` has the wrong length.
void ComputeDepthMaps(
    std::span<const StereoView> views, const SparseScene& scene, const Engine& engine,
    const DepthMapsOptions& options, Progress& progress,
    const std::function<bool(int view)>& already_done,
    const std::function<void(int view, DepthEstimate&&, const DepthRange&)>& on_view);

/// One pass of the engine (0: the search) alone, for processes that share the stores, each with
/// other views to be done. Throws as that does, and Error where planes of the pass before are
/// missing.
void ComputeDepthPass(std::span<const StereoView> views, const SparseScene& scene,
                      const Engine& engine, const DepthMapsOptions& options, int pass,
                      Progress& progress, const std::function<bool(int view)>& already_done);

/// The depth ranges that ComputeDepthMaps would work with: those of the options, or of the points,
/// widened where they prove too narrow. Throws as it does.
std::vector<DepthRange> WidenedRanges(std::span<const StereoView> views, const SparseScene& scene,
                                      const Engine& engine, const DepthMapsOptions& options,
                                      Progress& progress);

}  // namespace dtr::stereo
