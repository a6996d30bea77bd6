// pipeline/export/detail/points_from_depth.h -- points of a set's surfaces, for programs that begin
// with some.
#pragma once
#include <filesystem>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

struct PointsFromDepthOptions {
  size_t max_points = 100'000;  ///< what Gaussian splatting programs begin with
};

/// Points of the depth maps of a set with one frame (ReadSet), at most one per voxel of a grid that
/// is just coarse enough for `max_points`: even over the surfaces, however many views show them.
/// A view sees a point where its own depth agrees within 2 %; points that a single view sees, at
/// depth edges most of all, are left out. The same points for any number of threads.
SparseScene PointsFromDepth(const std::filesystem::path& folder, const DtrSet& set,
                            const PointsFromDepthOptions& options, Progress& progress);

}  // namespace dtr::pipeline
