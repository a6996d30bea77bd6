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

namespace dtr::stereo {

struct DepthMapsOptions {
  NeighbourOptions neighbours;
  DepthRangeOptions range;
  std::vector<DepthRange> given_ranges;  ///< one per view; empty: from the sparse points
  ConsistencyOptions consistency;
  EngineOptions engine;
  /// Where planes wait between the rounds of engines that have any, so that an interrupted run can
  /// go on from there; null: in memory, 24 bytes per pixel and view. Borrowed.
  PlaneMapStore* planes = nullptr;
};

/// Computes the depth map of every view for which `already_done(view)` is false and hands it to
/// `on_view`, in rising order of views, from the calling thread, as soon as it is final. A view
/// whose neighbours are not done depends on their unfiltered maps too; those are computed even if
/// the neighbours' own results are done, so a resumed run gives the same bytes as an undisturbed
/// one. With an engine that has rounds, all views go through one round before the next begins (see
/// RunRounds), and maps are handed out after the last. A view without neighbours, or for which the
/// engine finds no usable pair, gets a map of holes and a note. Throws what the engine throws,
/// Error when a depth range is unknown, Interrupted between views, UsageError when `given_ranges`
/// has the wrong length.
void ComputeDepthMaps(
    std::span<const StereoView> views, const SparseScene& scene, const Engine& engine,
    const DepthMapsOptions& options, Progress& progress,
    const std::function<bool(int view)>& already_done,
    const std::function<void(int view, DepthEstimate&&, const DepthRange&)>& on_view);

}  // namespace dtr::stereo
