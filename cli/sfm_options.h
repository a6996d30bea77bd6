// cli/sfm_options.h -- --feature-size, --features, --matching and --lens-model of the commands that
// calibrate photos.
#pragma once
#include <CLI/CLI.hpp>

#include "cli/pipeline/sfm_choice.h"

namespace dtr::cli {

void AddSfmOptions(CLI::App& command, pipeline::SfmChoice& choice);

}  // namespace dtr::cli
