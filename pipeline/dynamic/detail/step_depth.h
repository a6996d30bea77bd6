// pipeline/dynamic/detail/step_depth.h -- depth of all time steps of a dynamic set.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/dynamic/detail/background_views.h"

namespace dtr::pipeline {

struct StepDepthOptions {
  DepthChoice depth;
  stereo::QualitySettings quality;
  bool temporal = true;
  std::uint64_t seed = 0;
};

/// Time step `step` of `set` as a set of its own, to work on; PutBack takes its views back.
DtrSet TakeStep(DtrSet& set, size_t step);
void PutBack(DtrSet&& still, size_t step, DtrSet& set);

/// Computes and writes the depth of the source views of all time steps, whose images `writer` has,
/// and sets the scene's centre, bounds, baselines and gains, which are the same for all. `points`:
/// SparseScene whose views are those of a frame, of several time steps together.
///
/// Temporal: depth of what stands still (BackgroundViews) first; then of each time step, from its
/// own photos, only of pixels that show something else, which begin with the planes of the time
/// step before (stereo/time_step.h). Depth ranges are those of the points and of a look at three
/// time steps, the same for all. With fewer than three time steps there is nothing to tell what
/// stands still by: each is computed alone, with a note. Else every time step alone (DepthStage).
/// Time steps that an interrupted run finished are not computed again.
/// Returns the backgrounds where depth was computed over time.
std::optional<BackgroundViews> ComputeStepDepths(DtrSet& set, const SparseScene& points,
                                                 const StepDepthOptions& options,
                                                 io::SetWriter& writer, Progress& progress);

}  // namespace dtr::pipeline
