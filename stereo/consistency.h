// stereo/consistency.h -- depth maps checked against each other.
#pragma once
#include <span>

#include "stereo/engine.h"

namespace dtr::stereo {

struct ConsistencyOptions {
  int min_agreeing = 1;       ///< other depth maps that must confirm a pixel; 0 switches it off
  double tolerance_px = 1.0;  ///< pixels of disparity of the two views
};

/// Depth of another view to check against; borrowed.
struct OtherDepth {
  const StereoView* view = nullptr;
  const DepthEstimate* estimate = nullptr;
};

/// Makes holes of pixels that too few other maps confirm, or that more maps refute than confirm.
/// A pixel's point is projected into the other view; with z' its depth there and z'' the map's
/// (inverse depth interpolated within one surface), the difference in pixels of disparity is
/// fx' |c - c'| |1/z' - 1/z''|. Within the tolerance the map confirms; a map surface that lies
/// farther refutes (its view looks through the point); a nearer one hides it and says nothing.
/// A prior of the view confirms what lies within 2.5 standard deviations of it, off its edges.
/// The sigma of a pixel that is kept although c maps confirm and r > 0 refute it grows by
/// exp(5 r / (c + r + 1)): it is more likely to be wrong.
/// Pixels that are 0 in `wanted` (null: none) stay as they are.
/// Only the unfiltered inputs are read, so the order in which views are filtered has no influence.
DepthEstimate FilterByConsistency(const StereoView& view, const DepthEstimate& estimate,
                                  std::span<const OtherDepth> others,
                                  const ConsistencyOptions& options, const Mask* wanted = nullptr);

}  // namespace dtr::stereo
