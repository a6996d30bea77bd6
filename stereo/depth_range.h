// stereo/depth_range.h -- the depths worth searching, from the sparse points.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "dtr/types/sparse_scene.h"
#include "stereo/engine.h"

namespace dtr::stereo {

struct DepthRangeOptions {
  double percentile = 1.0;              ///< per cent of the inverse depths cut off at either end
  double near_margin = 1.3;             ///< the near end comes closer by this factor
  double far_margin = 1.5;              ///< the far end moves away by this factor
  int min_points = 12;                  ///< fewer points than this say nothing about a view's range
  std::vector<std::string> names = {};  ///< of the views, for errors; else they are numbered
};

/// Range of every view: percentiles of the inverse depths of the points it observes, widened.
/// A view with too few points takes all points of the scene that project into it.
/// Throws Error when a view has too few of either, std::invalid_argument when the scene names a
/// view or point that does not exist.
std::vector<DepthRange> DepthRangesFromPoints(std::span<const StereoView> views,
                                              const SparseScene& scene,
                                              const DepthRangeOptions& options);

}  // namespace dtr::stereo
