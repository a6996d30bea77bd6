// stereo/sgbm/fuse.h -- one depth per pixel from what several pairs say.
#pragma once
#include <span>

#include "stereo/engine.h"
#include "stereo/sgbm/match.h"

namespace dtr::stereo {

/// Per pixel the largest group of pairs whose inverse depths agree within a pixel of disparity
/// wins; its mean, weighted by 1/variance (so by baseline), is the depth. Sweeps of one pair are
/// one voice. With three pairs or more the group needs two members; a lone pair or two need one
/// that nothing contradicts. Else pairs that say something else are not held against it: most are
/// neighbours from which the point is hidden (a majority rule cost plaza 6 % of its true pixels
/// for 1.4 % fewer outliers, which the check between views finds better). Depths outside `range`
/// and masked pixels are holes. sigma of 1/z combines the noise of a disparity and the spread of
/// the group. `pair_count` is the number of pairs matched. The result does not depend on `threads`.
DepthEstimate FusePairs(const PinholeCamera& camera, const Mask* mask,
                        std::span<const PairDepth> sweeps, int pair_count, const DepthRange& range);

/// Makes holes of connected areas of fewer than `min_pixels` pixels; neighbours are connected where
/// their inverse depths differ by at most `max_steps` times the finest pair's pixel of disparity.
void RemoveSpeckles(const PinholeCamera& camera, std::span<const PairDepth> sweeps, int min_pixels,
                    double max_steps, DepthEstimate* estimate);

}  // namespace dtr::stereo
