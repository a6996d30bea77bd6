// cli/panorama_options.h -- the options of commands that take 360 degree panoramas.
#pragma once
#include <CLI/CLI.hpp>

#include "capture/split_panoramas.h"

namespace dtr::cli {

/// Adds --panoramas.
void AddPanoramaOption(CLI::App& command, capture::PanoramaUse& use);

}  // namespace dtr::cli
