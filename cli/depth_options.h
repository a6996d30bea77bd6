// cli/depth_options.h -- the options that `dtr build` and `dtr stereo` share.
#pragma once
#include <CLI/CLI.hpp>
#include <vector>

#include "pipeline/core/depth_settings.h"

namespace dtr::cli {

/// Declares them; parsing fills `choice`, which must outlive it. `engines`: what --engine offers.
void AddDepthOptions(CLI::App& command, const std::vector<std::string>& engines,
                     const std::string& preset_help, pipeline::DepthChoice& choice);

}  // namespace dtr::cli
