// pipeline/core/depth/gains.h -- how a set's photos were exposed, once their depth is known.
#pragma once
#include <filesystem>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

/// Sets the gain of every source view (EstimateGains) from the pixels in `folder`, and tells of
/// gains that differ. `sources_scene`: the sparse points, with views as indices among the source
/// views.
void SetGains(DtrSet& set, const SparseScene& sources_scene, const std::filesystem::path& folder,
              double memory_gb, Progress& progress);

}  // namespace dtr::pipeline
