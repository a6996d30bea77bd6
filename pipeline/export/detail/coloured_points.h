// pipeline/export/detail/coloured_points.h -- the points that programs begin with.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

/// The points of the calibration, or of the depth maps where the set has none (`from_depth`).
struct StartPoints {
  SparseScene scene;
  bool from_depth = false;
};
StartPoints StartPointsOf(const std::filesystem::path& folder, const DtrSet& set,
                          Progress& progress);

/// The image of a view without pixels: one at a time is in memory.
ImageRgb8 ImageOf(const std::filesystem::path& folder, View view);

/// Writes points relative to the set's origin with the mean colours of the views that see them:
/// PLY, float x, y, z and uchar red, green, blue. Returns how many.
size_t WritePointsPly(const std::filesystem::path& file, const std::filesystem::path& folder,
                      const DtrSet& set, const SparseScene& scene);

}  // namespace dtr::pipeline
