#include "cli/commands/validate_calibration.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "calib/boards/board.h"
#include "calib/boards/length.h"
#include "calib/validation/conclusion.h"
#include "calib/validation/report_json.h"
#include "cli/output_file.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "pipeline/boards/validate_calibration.h"

namespace dtr::cli {
namespace {

void SayStats(const std::string& camera, const char* what, const calib::ResidualStats& stats,
              double noise_px, Console& console) {
  if (stats.count == 0) return;
  console.Say(fmt::format("{:<16} {:<10} {:>7} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f}",
                          camera, what, stats.count, stats.rms_px, stats.median_px, stats.p95_px,
                          stats.worst_px, noise_px));
}

void SayReport(const calib::BoardValidation& report, Console& console) {
  console.Say(fmt::format("{:<16} {:<10} {:>7} {:>8} {:>8} {:>8} {:>8} {:>8}", "camera, px",
                          "corners", "count", "RMS", "median", "95 %", "worst", "noise"));
  for (const calib::ValidatedCamera& camera : report.cameras) {
    SayStats(camera.name, report.test_views ? "held out" : "own", camera.stored, camera.noise_px,
             console);
    SayStats(camera.name, "held out", camera.held_out, camera.noise_px, console);
  }
  for (const Check& test : report.tests) console.Say(calib::LineOf(test));
  if (!report.flipped.empty()) {
    console.Say(fmt::format("counted from the other end, and repaired: {}",
                            fmt::join(report.flipped, ", ")));
  }
  if (!report.test_views) {
    console.Say(
        "validated on the views that made the calibration; --images DIR with photos of the board "
        "that were held out tell more");
  }
}

void SayUncertainty(const calib::BoardValidation& report, bool metric, Console& console) {
  for (const calib::ValidatedCamera& camera : report.cameras) {
    for (const calib::UncertaintyAt& at : camera.uncertainty_at) {
      console.Say(fmt::format(
          "{} at {:g}{}: standard deviation of a projection {:.3g} px or less in 95 % of the "
          "image, median {:.3g} px",
          camera.name, at.distance, metric ? " m" : " (the squares' unit)", at.map.Quantile(0.95),
          at.map.Median()));
    }
  }
}

// In the unit of the board's squares.
std::vector<double> DistancesOf(const std::vector<std::string>& words, const calib::Board& board) {
  std::vector<double> distances;
  for (const std::string& word : words) {
    const auto length = calib::LengthFrom(word);
    if (!length) {
      throw UsageError(
          fmt::format("--at: expected distances above 0, as 2m or 60cm, found '{}'", word));
    }
    if (length->has_unit && !board.metric) {
      throw UsageError(fmt::format(
          "--at {}: the board's squares have no unit; expected distances in the same one", word));
    }
    distances.push_back(length->value);
  }
  return distances;
}

calib::Calibration Read(const ValidateCalibrationOptions& options) {
  const std::string file = options.file.string();
  if (options.pattern && !options.images) {
    throw UsageError("--pattern: says which photos of --images DIR; expected that, too");
  }
  if (options.file.extension() == ".json") {
    if (options.board) {
      throw UsageError(
          fmt::format("--board {}: {} says which board it was made from", *options.board, file));
    }
    calib::Calibration calibration = calib::ReadCalibration(options.file);
    if (calibration.views.empty() && !options.images) {
      throw UsageError(
          fmt::format("{}: has no observations; give photos of the board by --images", file));
    }
    return calibration;
  }
  if (!options.images || !options.board) {
    throw UsageError(fmt::format(
        "{}: has neither board nor observations; expected --board BOARD and --images DIR", file));
  }
  return pipeline::ForeignCalibration(options.file, calib::BoardFromText(*options.board));
}

}  // namespace

int RunValidateCalibration(const ValidateCalibrationOptions& options, const Context& context) {
  if (options.report) RequireOutputFile(*options.report, "--report", {".html"});
  const calib::Calibration calibration = Read(options);
  calib::BoardLimits limits;
  limits.max_rms_px = options.max_rms_px.value_or(limits.max_rms_px);
  limits.max_uncertainty_px = options.max_uncertainty_px.value_or(limits.max_uncertainty_px);
  const std::vector<double> distances = DistancesOf(options.at, calibration.board);
  std::optional<calib::TestViews> test_views;
  auto skipped = nlohmann::ordered_json::array();
  if (options.images) {
    pipeline::TestPhotos photos = pipeline::ReadTestPhotos(
        calibration, *options.images, options.pattern.value_or("*"), context.console);
    for (const calib::LeftOut& photo : photos.left_out) {
      context.console.Say(fmt::format("left out: {}: {}", photo.name, photo.reason));
      skipped.push_back({{"name", photo.name}, {"reason", photo.reason}});
    }
    test_views = std::move(photos.test_views);
  }
  const calib::BoardValidation report = calib::ValidateBoards(
      pipeline::ToValidate(calibration), test_views, limits, distances, &context.console);
  SayReport(report, context.console);
  SayUncertainty(report, calibration.board.metric, context.console);
  if (options.report) {
    WriteFileAtomically(*options.report,
                        pipeline::CalibrationPage(calibration, report,
                                                  "Calibration " + options.file.filename().string(),
                                                  options.images));
    context.console.Say("report: " + options.report->string());
  }
  nlohmann::ordered_json json = calib::JsonOf(report);
  json["skipped"] = skipped;
  context.EmitJson(json, -1);
  context.console.Say(calib::Conclusion(report.tests, calib::Validated::kBoards));
  return report.passed() ? kDone : kFailed;
}

int ValidateMade(const calib::Calibration& calibration, const Context& context,
                 nlohmann::ordered_json& json) {
  const calib::BoardValidation report =
      calib::ValidateBoards(pipeline::ToValidate(calibration), {}, {}, {}, &context.console);
  for (const Check& test : report.tests) {
    if (!test.passed) context.console.Say(calib::LineOf(test));
  }
  nlohmann::ordered_json all = calib::JsonOf(report);
  for (const char* kept : {"passed", "result", "conclusion", "tests"}) {
    json["validation"][kept] = std::move(all[kept]);
  }
  context.console.Say(calib::Conclusion(report.tests, calib::Validated::kBoards));
  return report.passed() ? kDone : kFailed;
}

}  // namespace dtr::cli
