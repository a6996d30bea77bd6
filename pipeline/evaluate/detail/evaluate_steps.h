// pipeline/evaluate/detail/evaluate_steps.h -- Evaluate of dynamic sets.
#pragma once
#include <functional>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/evaluate/evaluate.h"

namespace dtr::pipeline {

/// Evaluate of a set of several time steps, `described` as io::ReadSet gives it. Throws UsageError
/// where a time step has no folder of truth.
EvaluateResult EvaluateSteps(const EvaluateRequest& request, const DtrSet& described,
                             const std::function<eval::RenderFunction()>& make_renderer,
                             Progress& progress);

}  // namespace dtr::pipeline
