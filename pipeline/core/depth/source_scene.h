// pipeline/core/depth/source_scene.h -- what the source views of a set have in common.
#pragma once
#include <vector>

#include "dtr/types/sparse_scene.h"
#include "dtr/types/view.h"

namespace dtr::pipeline {

/// The scene as the source views alone know it, with views renumbered to their order among sources.
/// `sources`: their indices into `views`.
SparseScene SourceScene(const SparseScene& sparse, const std::vector<View>& views,
                        const std::vector<int>& sources);

/// Of each of these views its neighbours, at most `count`, best first, as indices into `sources`;
/// `scene` is what SourceScene gave.
std::vector<std::vector<int>> NeighboursOf(const std::vector<View>& views,
                                           const std::vector<int>& sources,
                                           const SparseScene& scene, int count);

}  // namespace dtr::pipeline
