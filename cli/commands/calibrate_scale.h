// cli/commands/calibrate_scale.h -- `dtr calibrate scale`.
#pragma once
#include "cli/command.h"

namespace dtr::cli {

void AddCalibrateScaleCommand(CLI::App& calibrate);

}  // namespace dtr::cli
