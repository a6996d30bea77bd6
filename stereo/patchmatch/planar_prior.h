// stereo/patchmatch/planar_prior.h -- what reliable planes say of weak texture between them.
#pragma once
#include "dtr/types/grid.h"
#include "stereo/patchmatch/kernel.h"

namespace dtr::stereo::patchmatch {

/// What a prior is made of, all of one size.
struct PriorSupport {
  const Grid<float>& w;         ///< inverse depth, in the level's units; 0 where none is reliable
  const Grid<float>& sigma_px;  ///< of it, pixels of disparity
  const Grid<float>& px_per_w;  ///< pixels of disparity per unit of inverse depth
};

/// Inverse depth that the surroundings expect, and its standard deviation; 0: they expect none.
struct Prior {
  Grid<float> w, sigma;
};

/// Surfaces are planes between what is known of them (Xu and Tao, AAAI 2020, who triangulate the
/// known). At each pixel where `wanted` is not 0, a plane is fitted by weighted least squares to
/// what is reliable in the window around it: the smallest of 17 to 129 pixels a side in which
/// enough is, that lies on all sides of the pixel, looks like it and lies on one plane within 1.5
/// pixels of disparity. Sums over fixed bands of rows, so the threads have no influence. Writes the
/// planes to `state` where the own one misses the prior by more than that is sure of.
Prior PlanarPrior(const Grid<float>& wanted, const PriorSupport& support, const Reference& picture,
                  State* state);

}  // namespace dtr::stereo::patchmatch
