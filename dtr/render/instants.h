// dtr/render/instants.h -- moving sets: several frames, of which a picture shows one.
#pragma once
#include "dtr/types/dtr_set.h"

namespace dtr {

/// The set as it was in frame `index`: that frame alone, with the set's centre, bounds and
/// metadata. Points behind the calibration belong to frame 0 and stay with it. Throws UsageError
/// where the set has no such frame.
DtrSet AtFrame(const DtrSet& set, size_t index);

/// Throws UsageError unless the set has exactly one frame: what knows still scenes alone must not
/// quietly take a moving one for its first frame.
void RequireOneFrame(const DtrSet& set);

/// The frame that picture `i` of `pictures` shows when they run through all `frames` from the
/// first to the last, each for an equal share of the pictures.
size_t FrameOfPicture(size_t i, size_t pictures, size_t frames);

}  // namespace dtr
