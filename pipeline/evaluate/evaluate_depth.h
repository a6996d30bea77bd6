// pipeline/evaluate/evaluate_depth.h -- a set's depth maps against true ones.
#pragma once
#include <filesystem>
#include <functional>

#include "dtr/base/progress.h"
#include "dtr/eval/depth_truth.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// Scores the depth of the set's source views (loaded) against `truth`: a folder with cameras.json,
/// depth maps in depth/ named as the list says, and optionally masks/NAME_visible.png and
/// NAME_texture.png. Truth of an exact scene made by `dtr dataset` (dataset.json beside it) is cast
/// again where the set's grid is another; other truth must be on that grid already.
/// The gauge: cameras that agree with the true ones are taken as they are; else one similarity is
/// fitted to the camera centres and its residual is reported.
/// Throws Error when a grid differs, the cameras cannot be aligned or a file is missing or broken.
eval::DepthScores EvaluateDepth(const DtrSet& set, const std::filesystem::path& truth,
                                Progress& progress);

/// The scorers of EvaluateDepth, that more than one set may be added to.
struct DepthScorers {
  eval::DepthScorer measured, completed;
};

/// Depth of a view as it is scored; borrowed.
struct ScoredDepth {
  const DepthImage& measured;
  const DepthImage& truth;
  const Mask& scored;
};

/// As EvaluateDepth, adding to `scorers`; hands out every view that is scored (null: to nobody).
void ScoreDepth(const DtrSet& set, const std::filesystem::path& truth, Progress& progress,
                DepthScorers* scorers,
                const std::function<void(const View&, const ScoredDepth&)>& on_view);
eval::DepthScores ScoresOf(const DepthScorers& scorers);

}  // namespace dtr::pipeline
