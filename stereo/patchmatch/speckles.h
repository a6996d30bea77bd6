// stereo/patchmatch/speckles.h -- small areas of depth: thin things, or chance.
#pragma once
#include <cstdint>

#include "dtr/types/grid.h"
#include "stereo/engine.h"

namespace dtr::stereo::patchmatch {

/// What small areas are evaluated by.
struct SpeckleEvidence {
  const Grid<float>& px_per_w;           ///< pixels of disparity per unit of near_z / z
  const Grid<std::uint8_t>& consistent;  ///< views whose planes lead to the pixel
  float near_z = 0;
  float w_range = 0;  ///< largest less smallest near_z / z of the search
};

/// Makes holes of connected areas smaller than a 10,000th of the image where too few views lead
/// to them, and where the small areas around lie at other depths: bars of a fence and leaves have
/// company at their own depth, chance matches (ground that repeats, surfaces beyond the range) are
/// scattered over all of it.
void RemoveSpeckles(const SpeckleEvidence& evidence, DepthEstimate* estimate);

}  // namespace dtr::stereo::patchmatch
