// pipeline/join.h -- sets of single time steps become one dynamic set.
#pragma once
#include <filesystem>
#include <vector>

#include "dtr/base/progress.h"

namespace dtr::pipeline {

struct JoinOptions {
  double frames_per_second = 24;  ///< frame i is at i / frames_per_second seconds
  bool force = false;
  int threads = 0;
};

/// Writes `target`, whose frame i holds the views of `sets[i]`: images and depth to the byte or
/// as their codings have them, reduced meshes too. Ids become tNNNN_ID, names stay, so that a
/// camera keeps its name through time. The world is that of the first set; centre and bounds are
/// those of all. Points behind the calibration and validation results stay behind: they are of one
/// time step. Throws UsageError for fewer than two sets or sets that are moving already, and Error
/// where units differ or a set cannot be read.
void JoinSets(const std::vector<std::filesystem::path>& sets, const std::filesystem::path& target,
              const JoinOptions& options, Progress& progress);

}  // namespace dtr::pipeline
