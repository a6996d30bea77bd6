// pipeline/dynamic/build_dynamic.h -- videos of fixed cameras in, one dynamic set out: what
// `dtr build --dynamic` does.
#pragma once
#include <optional>

#include "dtr/base/progress.h"
#include "dtr/io/camera_videos.h"
#include "pipeline/build/build.h"

namespace dtr::pipeline {

/// Options of `dtr build --dynamic` beside those of BuildOptions, by the same names. Of those,
/// `holdout` names cameras, held out at all time steps; `video.every` takes every N-th time step.
struct DynamicOptions {
  int from = 0;               ///< first time step of the recording
  std::optional<int> to;      ///< last one; empty: the recording's
  std::optional<double> fps;  ///< time steps per second; empty: as the videos say, of photos 24
  /// Depth begins with that of the time step before, and what does not move keeps one depth for
  /// all; false: every time step alone.
  bool temporal = true;
  /// Cameras began when they liked: how many frames later each one's are is found from what moves,
  /// and time steps take the nearest frames.
  bool free_clocks = false;
  /// Images of source cameras as videos; empty: every one a PNG.
  std::optional<io::VideoQuality> video;
};

/// Builds a set with a frame for each time step. Views are named as their cameras (videos or
/// folders of photos), ids are tNNNN_CAMERA. The calibration of `rig`, or that of structure from
/// motion from the first time step, holds for all. Memory holds one or two time steps. Continues an
/// interrupted run, time step by time step; throws as BuildSet and Recording, and UsageError for
/// options that do not go with it.
BuildReport BuildDynamicSet(const BuildOptions& options, const DynamicOptions& dynamic,
                            Progress& progress);

}  // namespace dtr::pipeline
