// stereo/patchmatch/trust.h -- which pixels' planes are believed, and how much.
#pragma once
#include "stereo/engine.h"
#include "stereo/patchmatch/kernel.h"

namespace dtr::stereo::patchmatch {

/// Depth and sigma from the planes of the finest level. Holes where the cost is high, too few views
/// agree, the minimum is flat, the mask forbids, or a small patch of surface stands alone.
DepthEstimate TrustedDepth(const Level& level, const State& state, const StereoView& view,
                           const DepthRange& range, int threads);

}  // namespace dtr::stereo::patchmatch
