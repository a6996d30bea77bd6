// pipeline/evaluate/evaluate.h -- how good a set is: by photos it was not made from, and against
// true depth.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>

#include "dtr/base/progress.h"
#include "dtr/eval/depth_truth.h"
#include "dtr/eval/flicker.h"
#include "dtr/eval/held_out.h"
#include "dtr/render/options.h"

namespace dtr::pipeline {

struct EvaluateRequest {
  std::filesystem::path set;
  bool leave_one_out = false;    ///< every source view in turn, instead of the held-out ones
  std::filesystem::path truth;   ///< folder with cameras.json and depth/; empty: no depth scores
  std::filesystem::path images;  ///< folder for rendering | photo | difference; empty: none
  bool force = false;            ///< files in that folder may be replaced
  RenderOptions render;
  bool measured_only = false;  ///< images are drawn without completed depth
};

struct EvaluateResult {
  eval::EvaluationReport views;
  std::optional<eval::DepthScores> depth;      ///< where there is truth
  std::optional<eval::FlickerScores> flicker;  ///< of dynamic sets with truth
  size_t time_steps = 1;  ///< several: figures of a view are means over them, of depth pooled
};

/// Dynamic sets: the same for every time step, one in memory; `truth` has a folder for each then,
/// by the time step's number (as `dtr dataset make` writes truth/), and `images` one too.
/// Renders every held-out view and compares it with its photo. `make_renderer` is called once, if
/// there is anything to render. Throws UsageError where there is nothing to measure, Error for a
/// broken set or truth.
EvaluateResult Evaluate(const EvaluateRequest& request,
                        const std::function<eval::RenderFunction()>& make_renderer,
                        Progress& progress);

}  // namespace dtr::pipeline
