// cli/commands/validate_calibration.h -- `dtr validate` of a calibration file.
#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/calibration.h"
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

/// What `calibrate board` and `calibrate rig` end with once their files are written: the tests that
/// `dtr validate` makes, of which those that failed are printed, and the sentence. Returns the exit
/// code and puts `validation` into `json`: passed, result, conclusion, tests[].
int ValidateMade(const calib::Calibration& calibration, const Context& context,
                 nlohmann::ordered_json& json);

}  // namespace dtr::cli
