// stereo/patchmatch/planar_prior.h -- what reliable planes say of weak texture between them.
#pragma once
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"
#include "stereo/patchmatch/kernel.h"

namespace dtr::stereo::patchmatch {

/// Pixels of disparity by which a prior may be wrong: planes that lead to places farther apart give
/// none.
constexpr float kPriorSigmaPx = 1.0f;

/// Surfaces are planes between what is known of them (Xu and Tao, AAAI 2020, who triangulate the
/// known). At each pixel where `wanted` is not 0 the planes of the next reliable pixels to the
/// left, right, top and bottom, none of them far away, are continued to it. Where all four lead to
/// the same inverse depth that is the prior, else 0. `reliable`: depths that are believed;
/// `px_per_w`: pixels of disparity per unit of inverse depth. Writes the priors' mean slopes to
/// `state` where the own plane misses the prior, and the prior itself: the planes to be judged
/// anew.
Grid<float> PlanarPrior(const Grid<float>& wanted, const DepthImage& reliable,
                        const Grid<float>& px_per_w, int threads, State* state);

}  // namespace dtr::stereo::patchmatch
