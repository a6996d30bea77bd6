// stereo/patchmatch/expected.h -- depth of another instrument on the pixels of a level.
#pragma once
#include "stereo/depth_prior.h"
#include "stereo/engine.h"
#include "stereo/patchmatch/kernel.h"

namespace dtr::stereo::patchmatch {

/// Planes of a prior at the level's pixels, with how sure they are. Pixels at depth edges of the
/// prior have a plane to try and no certainty; those without depth, or with one out of the range,
/// have neither.
Expected ExpectedOf(const Level& level, const PriorPlanes& planes, const RelativeNoise& noise,
                    const DepthRange& range);

}  // namespace dtr::stereo::patchmatch
