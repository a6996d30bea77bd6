// pipeline/core/run/finishing.h -- what is worked out once all depth maps lie in the set's
// folder, several views at a time where there is room. All of it tells of its views and can be
// stopped between them.
#pragma once
#include <functional>
#include <span>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/core/run/side_by_side.h"
#include "stereo/complete/scene_planes.h"

namespace dtr::pipeline {

/// Scene centre, bounds and baselines: from the stored depth maps or, without any, from `points`.
void FinishScene(DtrSet& set, std::span<const SparsePoint> points, const io::SetWriter& writer,
                 double memory_gb, Progress& progress);

/// Stores the depth of every source view again as zstd-inverse, with 1/z off by at most `error_px`
/// pixels of disparity from what the stereo engine gave. After FinishScene: pixels of disparity
/// need the baselines. Throws Error where 16 bits cannot keep the bound.
void RecodeDepth(DtrSet& set, double error_px, io::SetWriter& writer, double memory_gb,
                 Progress& progress);

/// Completed depth that is known before, of views of a set by their index.
struct KnownCompletion {
  /// In holes of the loaded view (image, mask, measured depth), 0 elsewhere; called from any
  /// thread.
  std::function<DepthImage(size_t view, const View& loaded)> depth;
  /// The near end of the range that the view's completed depth is stored in; what is found nearer
  /// is put there.
  std::function<double(size_t view)> near_z;
  /// The planes of the scene, as CompleteDepth found them before.
  std::vector<stereo::ScenePlane> planes;
};

/// Completes the depth of every source view (stereo/complete): what was not measured gets the
/// depth of a surface or is far. After FinishScene: pixels of disparity need the baselines. Where
/// the room's memory is too little, or nothing was measured at all, a note says so and depth stays
/// as it is. `sparse`: views are indices into the set's. What is `known` stays as it is, and the
/// rest is completed as if it had been measured. Returns the planes of the scene that cells chose
/// among.
std::vector<stereo::ScenePlane> CompleteDepth(DtrSet& set, const SparseScene& sparse,
                                              io::SetWriter& writer, double memory_gb,
                                              Progress& progress,
                                              const KnownCompletion& known = {});

/// How much of the source views has a measured depth.
struct DepthCount {
  int maps = 0;
  long with_depth = 0, pixels = 0;
  double Completeness() const {
    return pixels > 0 ? static_cast<double>(with_depth) / static_cast<double>(pixels) : 0;
  }
};

/// Writes the reduced mesh (SPEC 5.1) of every source view that has depth, as renderers make it
/// with their default options. After FinishScene: thresholds need the baselines.
DepthCount WriteMeshes(DtrSet& set, io::SetWriter& writer, double memory_gb, Progress& progress);

}  // namespace dtr::pipeline
