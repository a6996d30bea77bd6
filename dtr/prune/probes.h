// dtr/prune/probes.h -- places between a set's cameras, to look at it from.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/render/camera_path.h"

namespace dtr::prune {

/// Cameras between source views of the set's first frame and one of their nearest neighbours: the
/// centre on the line between the two, the rotation between theirs, the intrinsics of the first.
/// First views are spread evenly over the set in byte order of their ids, so that every part of it
/// is looked at; partner and place are drawn from the seed.
/// Does not depend on the order of the views. Throws dtr::Error for less than 2 source views.
std::vector<NovelCamera> DrawProbes(const DtrSet& set, int count, std::uint64_t seed);

}  // namespace dtr::prune
