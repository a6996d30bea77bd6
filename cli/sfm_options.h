// cli/sfm_options.h -- --feature-size, --features, --matching, --lens-model and
// --camera-per of the commands that calibrate photos.
#pragma once
#include <CLI/CLI.hpp>

#include "pipeline/core/sfm_settings.h"

namespace dtr::cli {

/// Returns --camera-per: a camera that is known excludes it.
CLI::Option* AddSfmOptions(CLI::App& command, pipeline::SfmChoice& choice);

}  // namespace dtr::cli
