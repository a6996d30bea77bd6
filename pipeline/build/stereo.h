// pipeline/build/stereo.h -- new depth maps for a set that has cameras: `dtr stereo`.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "dtr/base/progress.h"
#include "pipeline/core/depth_settings.h"

namespace dtr::pipeline {

struct RecomputeOptions {
  std::filesystem::path set;
  std::filesystem::path output;  ///< empty: `set` itself is replaced
  DepthChoice depth;
  std::filesystem::path normals;  ///< folder for normals (DepthStageOptions); empty: none
  bool force = false;
  std::uint64_t seed = 0;
};

struct RecomputeReport {
  std::filesystem::path written;
  int depth_maps = 0;
  double depth_completeness = 0;  ///< share of the source views' depth pixels that have a depth
  std::optional<DepthPriorReport> prior;  ///< where there was one
};

/// JSON object: set, depth_maps, depth_completeness, depth_prior (where there was one, as ToJson of
/// DepthPriorReport).
std::string ToJson(const RecomputeReport& report);

/// Writes the set again with depth maps by `engine`; cameras, images and sparse points stay. The
/// old set is whole until the new one is. Throws Error when the set carries no sparse points to
/// find depth ranges from, UsageError when the output exists.
RecomputeReport RecomputeDepth(const RecomputeOptions& options, Progress& progress);

}  // namespace dtr::pipeline
