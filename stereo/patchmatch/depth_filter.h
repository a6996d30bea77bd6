// stereo/patchmatch/depth_filter.h -- which pixels keep their depth, and its sigma.
#pragma once
#include "stereo/engine.h"
#include "stereo/patchmatch/kernel.h"
#include "stereo/time_step.h"

namespace dtr::stereo::patchmatch {

/// Depth and sigma from the planes of the finest level. Holes where the cost is high, too few views
/// agree, the minimum is flat, the mask forbids, a small patch of surface stands alone, or a
/// texture repeats. Where texture is weak or the minimum flat, reliable planes all around give a
/// prior (PlanarPrior) that the pixel's own plane is combined with, or that stands in its place in
/// `state` if the photos say no more against it. `planes_left_out`: hardly a pixel needs that,
/// and no planes were fitted. With `time_step` (that of level.open) settled pixels keep their
/// depth, and only open ones are filtered.
DepthEstimate FilteredDepth(const Level& level, const StereoView& view, const DepthRange& range,
                            const TimeStep* time_step, State* state, bool* planes_left_out);

}  // namespace dtr::stereo::patchmatch
