#include <fmt/format.h>

#include <filesystem>

#include "calib/validation/boards.h"
#include "calib/validation/conclusion.h"
#include "cli/command.h"
#include "cli/commands/validate_calibration.h"
#include "cli/commands/validate_set.h"
#include "cli/number_checks.h"
#include "cli/output_file.h"
#include "cli/suggestions.h"
#include "dtr/base/error.h"
#include "pipeline/core/camera_file.h"
#include "pipeline/validate/validate.h"

namespace dtr::cli {
namespace {

struct ValidateArguments {
  std::filesystem::path set;
  pipeline::SetLimits limits;
  std::optional<double> max_cross_px;
  std::string format;  // of cameras of photos; empty: by their content
  ValidateCalibrationOptions calibration;
};

void RejectForSets(const ValidateCalibrationOptions& options) {
  for (const auto& [given, name] :
       {std::pair{options.images.has_value(), "--images"},
        std::pair{options.pattern.has_value(), "--pattern"},
        std::pair{options.board.has_value(), "--board"},
        std::pair{options.max_uncertainty_px.has_value(), "--max-uncertainty"},
        std::pair{!options.at.empty(), "--at"}}) {
    if (!given) continue;
    throw UsageError(fmt::format("{}: is for cameras and calibrations, not for sets", name));
  }
}

// What concerns calibration files alone.
void AddCalibrationOptions(CLI::App& command, ValidateCalibrationOptions& calibration) {
  command
      .add_option("--pattern", calibration.pattern,
                  "Only photos of these names, as 'left*.jpg' [*]")
      ->type_name("PATTERN");
  command
      .add_option("--board", calibration.board,
                  "The board of the photos, as calibrate board has it; for cameras from "
                  "elsewhere")
      ->type_name("BOARD");
  command
      .add_option("--max-uncertainty", calibration.max_uncertainty_px,
                  fmt::format("Limit of the projections' standard deviation at the boards' "
                              "distance [{}]",
                              calib::BoardLimits{}.max_uncertainty_px))
      ->check(kPositive)
      ->type_name("PX");
  command
      .add_option("--at", calibration.at,
                  "Of a calibration file: also report the projections' standard deviation at "
                  "these distances from the camera, as 2m or 60cm, or in the unit of the "
                  "board's squares")
      ->delimiter(',')
      ->type_name("D,...");
}

int RunCameras(const ValidateArguments& options, const Context& context) {
  const ValidateCalibrationOptions& given = options.calibration;
  if (options.max_cross_px) throw UsageError("--max-cross: is for sets, which have depth");
  if (given.pattern || given.board || given.max_uncertainty_px || !given.at.empty()) {
    throw UsageError(options.set.string() +
                     ": --pattern, --board, --max-uncertainty and --at are for calibrations of "
                     "boards, not for cameras of photos");
  }
  const ValidateCamerasOptions cameras{options.set, options.format, given.images.value_or(""),
                                       given.report, options.limits};
  if constexpr (DTR_WITH_IMPORT) {
    return RunValidateCameras(cameras, context);
  } else {
    throw UsageError(BuiltWithout("validate CAMERAS"));
  }
}

int RunValidate(ValidateArguments options, const Context& context) {
  options.limits.max_cross_px = options.max_cross_px.value_or(options.limits.max_cross_px);
  double& max_rms_px = options.limits.reprojection.max_rms_px;
  max_rms_px = options.calibration.max_rms_px.value_or(max_rms_px);
  if (const auto& page = options.calibration.report) {
    RequireOutputFile(*page, "--report", {".html"});
  }
  if (AreCamerasOfPhotos(options.set, options.format, options.calibration.images.has_value())) {
    return RunCameras(options, context);
  }
  if (std::filesystem::is_regular_file(options.set)) {
    if (options.max_cross_px) {
      throw UsageError("--max-cross: is for sets, not for calibration files");
    }
    if (const std::string line = BuiltWithout("validate CALIB"); !line.empty()) {
      throw UsageError(line);
    }
    options.calibration.file = options.set;
    if constexpr (DTR_WITH_BOARDS) return RunValidateCalibration(options.calibration, context);
  }
  RejectForSets(options.calibration);
  const ValidatedSet validated = ValidateOneSet(options.set, options.limits, context);
  const pipeline::SetValidation& report = validated.report;
  const std::string conclusion = calib::Conclusion(report.tests, calib::Validated::kPhotos);
  WritePage(options.calibration.report, options.set, validated,
            options.set.lexically_normal().filename().string(), conclusion, context.console);
  context.EmitJson(pipeline::ToJson(report));
  context.console.Say(conclusion);
  return report.passed() ? kDone : kFailed;
}

}  // namespace

void AddValidateCommand(CLI::App& app) {
  AddCommand(
      app, "validate", "Test the cameras of a set, another program or a board",
      "dtr validate left.json --images held_out/ --report left.html",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<ValidateArguments>();
        command
            .add_option("SET|CAMERAS|CALIB", options->set,
                        "A set; cameras of photos in any format of `dtr import`; or a calibration "
                        "of boards: a .json of calibrate board or rig, a .yml of OpenCV, a "
                        "cameras.txt of COLMAP")
            ->required();
        ValidateCalibrationOptions& calibration = options->calibration;
        command
            .add_option("--images", calibration.images,
                        "Of cameras: their photos. Of a calibration: photos of the board that it "
                        "has not seen [those it was made from]")
            ->type_name("DIR");
        command.add_option("--format", options->format, "Format of the cameras [by their content]")
            ->check(CLI::IsMember(pipeline::CameraFormats()));
        command
            .add_option("--max-rms", calibration.max_rms_px,
                        fmt::format("Limit of the RMS on what the calibration has not seen [{} for "
                                    "sets, {} for calibration files]",
                                    options->limits.reprojection.max_rms_px,
                                    calib::BoardLimits{}.max_rms_px))
            ->check(kPositive)
            ->type_name("PX");
        command
            .add_option(
                "--max-cross", options->max_cross_px,
                fmt::format("Limit of the error of depth carried into a neighbour and back, median "
                            "of a set's pixels; the worst view may have twice as much [{}]",
                            options->limits.max_cross_px))
            ->check(kPositive)
            ->type_name("PX");
        if constexpr (DTR_WITH_BOARDS) AddCalibrationOptions(command, calibration);
        command
            .add_option("--report", calibration.report,
                        "The report as a page: residuals, coverage, uncertainty, worst views")
            ->type_name("FILE.html");
        return [options](const Context& context) { return RunValidate(*options, context); };
      });
}

}  // namespace dtr::cli
