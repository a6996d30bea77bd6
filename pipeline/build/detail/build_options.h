// pipeline/build/detail/build_options.h -- options of `dtr build` before any work.
#pragma once
#include "pipeline/build/build.h"

namespace dtr::pipeline {

/// With what the preset says in the place of what was not asked for.
BuildOptions ByPreset(BuildOptions options);

/// Throws UsageError where options ask for what cannot be had together.
void RequireOptions(const BuildOptions& options);
/// The same of photos that are views of panoramas.
void RequirePanoramaOptions(const BuildOptions& options);

}  // namespace dtr::pipeline
