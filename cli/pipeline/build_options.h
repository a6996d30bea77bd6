// cli/pipeline/build_options.h -- internal to cli/pipeline: options of `dtr build` before any work.
#pragma once
#include "cli/pipeline/build_set.h"

namespace dtr::pipeline {

/// With what the preset says in the place of what was not asked for.
BuildOptions ByPreset(BuildOptions options);

/// Throws UsageError where options ask for what cannot be had together.
void RequireOptions(const BuildOptions& options);

}  // namespace dtr::pipeline
