#include <fmt/format.h>

#include <filesystem>

#include "calib/validation/boards.h"
#include "calib/validation/conclusion.h"
#include "cli/command.h"
#include "cli/commands/validate_calibration.h"
#include "cli/number_checks.h"
#include "cli/output_file.h"
#include "cli/suggestions.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/validate/validate.h"

namespace dtr::cli {
namespace {

struct ValidateArguments {
  std::filesystem::path set;
  pipeline::SetLimits limits;
  std::optional<double> max_cross_px;
  ValidateCalibrationOptions calibration;
};

void SayReport(const pipeline::SetValidation& report, Console& console) {
  console.Say(fmt::format("{:<24} {:>7} {:>8} {:>8} {:>8} {:>8}", "camera (held-out, px)", "count",
                          "RMS", "median", "95 %", "worst"));
  for (const auto& camera : report.cameras) {
    const auto& held_out = camera.held_out;
    console.Say(fmt::format("{:<24} {:>7} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f}", camera.name,
                            held_out.count, held_out.rms_px, held_out.median_px, held_out.p95_px,
                            held_out.worst_px));
  }
  for (const Check& test : report.tests) console.Say(calib::LineOf(test));
  if (!report.adjustment.not_validated.empty()) {
    console.Say("not validated by a fresh bundle adjustment: " + report.adjustment.not_validated);
  }
  for (const std::string& name : report.untested) {
    console.Say("not tested, too few observations: " + name);
  }
  for (const std::string& name : report.kept_apart) {
    console.Say("not tested, held out without observations; dtr evaluate measures by it: " + name);
  }
}

void RejectForSets(const ValidateCalibrationOptions& options) {
  for (const auto& [given, name] :
       {std::pair{options.images.has_value(), "--images"},
        std::pair{options.pattern.has_value(), "--pattern"},
        std::pair{options.board.has_value(), "--board"},
        std::pair{options.max_uncertainty_px.has_value(), "--max-uncertainty"},
        std::pair{!options.at.empty(), "--at"}}) {
    if (given) throw UsageError(fmt::format("{}: is for calibration files, not for sets", name));
  }
}

// What concerns calibration files alone.
void AddCalibrationOptions(CLI::App& command, ValidateCalibrationOptions& calibration) {
  command
      .add_option("--images", calibration.images,
                  "Photos of the board that the calibration has not seen; without them it is "
                  "validated on those it was made from")
      ->type_name("DIR");
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

int RunValidate(ValidateArguments options, const Context& context) {
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
  double& max_rms_px = options.limits.reprojection.max_rms_px;
  max_rms_px = options.calibration.max_rms_px.value_or(max_rms_px);
  options.limits.max_cross_px = options.max_cross_px.value_or(options.limits.max_cross_px);
  const auto& page = options.calibration.report;
  if (page) RequireOutputFile(*page, "--report", {".html"});
  const DtrSet set = io::ReadSet(options.set);
  RequireOneFrame(set);
  const SparseScene sparse = io::LoadSparse(options.set, set);
  const auto report =
      pipeline::ValidateSet(options.set, set, sparse, options.limits, context.console);
  SayReport(report, context.console);
  if (page) {
    const std::string name = options.set.lexically_normal().filename().string();
    WriteFileAtomically(
        *page, pipeline::ValidationPage(options.set, set, report, "Calibration of " + name));
    context.console.Say("report: " + page->string());
  }
  context.EmitJson(pipeline::ToJson(report));
  context.console.Say(calib::Conclusion(report.tests, calib::Validated::kPhotos));
  return report.passed() ? kDone : kFailed;
}

}  // namespace

void AddValidateCommand(CLI::App& app) {
  AddCommand(
      app, "validate", "Test the calibration of a set or of a board; exit 1 when a test fails",
      "dtr validate left.json --images held_out/ --report left.html",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<ValidateArguments>();
        command
            .add_option("SET|CALIB", options->set,
                        "A set, a .json file of calibrate board or calibrate rig, or one camera "
                        "from elsewhere: a .yml of OpenCV, a cameras.txt of COLMAP")
            ->required();
        ValidateCalibrationOptions& calibration = options->calibration;
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
