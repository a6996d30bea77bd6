// pipeline/build/join.h -- sets of one time step or several become one dynamic set.
#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/camera_videos.h"

namespace dtr::pipeline {

struct JoinOptions {
  /// Time steps of sets that have one each. Dynamic sets keep their own times, one set after the
  /// other, as far apart as their time steps are on average.
  double frames_per_second = 24;
  /// Images of source cameras as videos; empty: every one a PNG. Those of sets that have videos
  /// are decoded, and coded again.
  std::optional<io::VideoQuality> video;
  bool force = false;
};

/// Writes `target`, whose time steps are those of `sets`, one set after the other: images and depth
/// to the byte or as their codings have them, reduced meshes too; depth of what stands still once
/// (StoreStillOnce). Ids become tNNNN_ID, names stay, so that a camera keeps its name through time.
/// The world is that of the first set; centre and bounds are those of all. Points behind the
/// calibration and validation results stay behind: they are of one time step. Returns how many time
/// steps there are. Throws UsageError for fewer than two sets, and Error where units differ or a
/// set cannot be read.
size_t JoinSets(const std::vector<std::filesystem::path>& sets, const std::filesystem::path& target,
                const JoinOptions& options, Progress& progress);

}  // namespace dtr::pipeline
