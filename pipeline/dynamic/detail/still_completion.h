// pipeline/dynamic/detail/still_completion.h -- completed depth of what stands still, decided once
// for all time steps.
#pragma once
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/core/run/finishing.h"
#include "pipeline/dynamic/detail/background_views.h"

namespace dtr::pipeline {

/// The completed depth of the backgrounds, for settled pixels of every time step. Used while the
/// writer has their files.
class StillCompletion {
 public:
  /// Completes the backgrounds' depth. `views`: those of a time step; `points`: its views are
  /// indices into them.
  StillCompletion(BackgroundViews backgrounds, const SparseScene& points,
                  const std::vector<View>& views, io::SetWriter& writer, double memory_gb,
                  Progress& progress);

  /// What is known of a time step with these views; they and this must outlive it.
  KnownCompletion Of(const std::vector<View>& views) const;

 private:
  DepthImage Known(size_t source, const View& loaded) const;

  BackgroundViews backgrounds_;
  io::SetWriter& writer_;
  std::vector<stereo::ScenePlane> planes_;
};

}  // namespace dtr::pipeline
