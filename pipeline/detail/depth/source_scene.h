// pipeline/detail/depth/source_scene.h -- the points of a set that its source views know.
#pragma once
#include <vector>

#include "dtr/types/sparse_scene.h"
#include "dtr/types/view.h"

namespace dtr::pipeline {

/// The scene as the source views alone know it, with views renumbered to their order among sources.
/// `sources`: their indices into `views`.
SparseScene SourceScene(const SparseScene& sparse, const std::vector<View>& views,
                        const std::vector<int>& sources);

}  // namespace dtr::pipeline
