// cli/commands/validate_calibration.h -- `dtr validate` of a calibration file.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/command.h"

namespace dtr::cli {

struct ValidateCalibrationOptions {
  std::filesystem::path file;
  std::optional<std::filesystem::path> images, report;
  std::optional<std::string> pattern, board;  ///< of the photos' names; as calibrate board has it
  std::optional<double> max_rms_px, max_uncertainty_px;
  std::vector<std::string>
      at;  ///< distances at which uncertainty is reported, as people write lengths
};

/// Validates, prints one line per test, writes the page where asked for; kFailed when a test
/// breaks.
int RunValidateCalibration(const ValidateCalibrationOptions& options, const Context& context);

}  // namespace dtr::cli
