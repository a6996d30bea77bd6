// stereo/patchmatch/hypotheses.h -- planes that other views' maps suggest for the reference.
#pragma once
#include "stereo/patchmatch/kernel.h"

namespace dtr::stereo::patchmatch {

/// Fills state->hypotheses: every plane of every source's surface is moved to the pixel of the
/// reference where it is seen; of those that differ from the pixel's own plane, the nearest and the
/// farthest are kept. Behind a thin or near thing, half the views look at what is wanted.
void HypothesesFromSurfaces(const Level& level, State* state);

/// Pixels that points move per unit of inverse depth, mean of the sources: of the image's centre,
/// or of its corners where that tells nothing.
float MeanPxPerInverseDepth(const Level& level);

}  // namespace dtr::stereo::patchmatch
