// pipeline/core/depth/depth_stage.h -- depth for the source views of a set, written view by view.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/part.h"
#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/core/depth/depth_priors.h"
#include "pipeline/core/depth_settings.h"
#include "stereo/depth_maps.h"
#include "stereo/engine.h"
#include "stereo/time_step.h"

namespace dtr::pipeline {

/// A step of the depth stage, for one of several processes that share the set.
struct DepthStep {
  static constexpr int kRanges = -1;
  /// kRanges: depth ranges, widened where they prove too narrow, by one process; 0: the search; 1
  /// and more: passes of an engine that has any; one more than these: the maps.
  int pass = kRanges;
  Part part = {};  ///< of the views
};

struct DepthStageOptions {
  std::uint64_t seed = 0;
  /// Where normals of the source views go, named as the depth maps, .exr, as stereo::NormalsOf
  /// gives them; empty: nowhere.
  std::filesystem::path normals = {};
  PhotoCameras photos = {};  ///< of the views, for depth priors; empty: views are their own photos
  /// Where checkpoints between its steps lie; empty: the writer's work folder.
  std::filesystem::path work = {};
  /// Depth ranges of the source views, which then are those of the stored depth, too; empty: from
  /// the points, widened where they prove too narrow.
  std::vector<stereo::DepthRange> ranges = {};
  /// What other time steps say of the source views; empty: nothing.
  std::vector<stereo::TimeStepSource> time_steps = {};
  bool gains = true;  ///< the views' gains are estimated
  /// Called before the error of a depth prior that is rejected is thrown, so that what was done
  /// before may be kept; empty: the writer's work is discarded.
  std::function<void()> keep_work = {};
};

/// What became of the depth stage.
struct DepthStageResult {
  stereo::QualitySettings quality;  ///< that was asked for or, with a time budget, what fitted
  std::optional<DepthPriorReport> prior;
  /// What its planes were computed from, for PlaneFiles of `planes` in its work folder: those of
  /// the last pass stay there.
  std::string planes_made_from;
};

/// Names of the files in DepthStageOptions::normals: of every source view.
std::vector<std::string> NormalFileNames(const DtrSet& set);

/// Writes the pixels of a view, or finds them written by an earlier, interrupted run, and frees
/// them.
void StoreImage(View& view, LengthUnit unit, io::SetWriter& writer);

/// Computes the depth of every source view with the engine chosen ("none": none, all holes are
/// rejected later by renderers) and writes it through `writer`, which has the views' images
/// (StoreImage). Views finished by an earlier, interrupted run are taken from the writer. Only
/// source views and the points they alone know reach the engine. Pixels are in memory only as long
/// as they are worked with, within the memory chosen: UsageError when that is too little. Throws as
/// DepthPriors does. With `step` only this is done, and Error where a step before it is not.
DepthStageResult DepthStage(DtrSet& set, const SparseScene& sparse, const DepthChoice& choice,
                            const stereo::QualitySettings& quality,
                            const DepthStageOptions& options, io::SetWriter& writer,
                            Progress& progress, const std::optional<DepthStep>& step = {});

}  // namespace dtr::pipeline
