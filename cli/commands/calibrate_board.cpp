#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/files/summary_json.h"
#include "calib/models/board_model.h"
#include "capture/contents_json.h"
#include "cli/command.h"
#include "cli/commands/validate_calibration.h"
#include "cli/output_file.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "pipeline/boards/calibrate_board.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

struct CalibrateBoardArguments {
  fs::path photos;
  std::vector<fs::path> outputs;
  std::string board, model = "auto", images = "*", detector = "auto", loss = "robust";
};

std::optional<calib::BoardModel> ModelFrom(const std::string& name) {
  if (name == "auto") return std::nullopt;
  const auto model = calib::BoardModelFromName(name);
  if (!model) throw UsageError("--model " + name + ": expected auto or the name of a model");
  return model;
}

calib::ChessboardDetector DetectorFrom(const std::string& name) {
  if (name == "quads") return calib::ChessboardDetector::kQuads;
  if (name == "sectors") return calib::ChessboardDetector::kSectors;
  return calib::ChessboardDetector::kAuto;
}

void SayModels(const calib::Calibration& calibration, Console& console) {
  if (calibration.models.empty()) return;
  console.Say(fmt::format("{:<10} {:>12} {:>14}   {}", "model", "coefficients", "held-out px",
                          "difference to the best, 95 %"));
  for (const calib::TriedModel& tried : calibration.models) {
    const std::string name = calib::NameOf(tried.model);
    const int coefficients = calib::FreeParameterCount(tried.model);
    if (!tried.held_out_rms_px) {
      console.Say(fmt::format("{:<10} {:>12} {:>14}   {}", name, coefficients, "-", tried.refused));
      continue;
    }
    console.Say(fmt::format("{:<10} {:>12} {:>14.4f}   {:+.4f} to {:+.4f}{}", name, coefficients,
                            *tried.held_out_rms_px, tried.low_px, tried.high_px,
                            tried.chosen ? "   <- chosen" : ""));
  }
}

void SayCamera(const calib::Calibration& calibration, Console& console) {
  const calib::CalibratedCamera& camera = calibration.cameras.front();
  console.Say(fmt::format("{}, {} x {} px", calib::NameOf(camera.model), camera.camera.width_px,
                          camera.camera.height_px));
  const auto names = calib::FreeParameterNames(camera.model);
  for (size_t i = 0; i < names.size(); ++i) {
    const auto at = static_cast<long>(i);
    console.Say(fmt::format("  {:<6} {:>14.6g} +- {:.2g}", names[i], camera.camera.params[i],
                            std::sqrt(camera.covariance(at, at))));
  }
  size_t corners = 0, outliers = 0;
  std::vector<double> noise;
  for (const calib::CalibratedView& view : calibration.views) {
    corners += view.seen.corners.size();
    outliers += view.outliers.size();
    if (!view.outliers.empty()) {
      console.Say(
          fmt::format("outliers: {}: corners {}", view.seen.name, fmt::join(view.outliers, ", ")));
    }
    if (std::isfinite(view.seen.noise_px)) noise.push_back(view.seen.noise_px);
  }
  for (const calib::LeftOut& item : calibration.left_out) {
    console.Say(fmt::format("left out: {}: {}", item.name, item.reason));
  }
  console.Say(
      fmt::format("{} views, {} corners, {} outliers; RMS {:.4f} px, sigma {:.4f} px per "
                  "coordinate",
                  calibration.views.size(), corners, outliers, camera.rms_px, camera.sigma_px));
  if (noise.empty()) return;
  const auto middle = UpperMedian(noise);
  console.Say(
      fmt::format("the noise of the pixels alone would make {:.4f} px (median view); what is "
                  "above that is camera model, board, blur or motion",
                  middle));
}

int RunCalibrateBoard(const CalibrateBoardArguments& options, const Context& context) {
  const calib::Board board = calib::BoardFromText(options.board);
  for (const fs::path& output : options.outputs) {
    RequireOutputFile(output, "-o", {".json", ".yml", ".yaml", ".txt"});
  }
  pipeline::BoardCalibrationOptions calibrate;
  calibrate.model = ModelFrom(options.model);
  calibrate.solve.loss =
      options.loss == "quadratic" ? calib::Loss::kQuadratic : calib::Loss::kRobust;
  calibrate.seed = context.common.seed;
  calib::DetectOptions detect;
  detect.detector = DetectorFrom(options.detector);
  const auto photos =
      pipeline::ReadBoardPhotos(options.photos, options.images, board, detect, context.console);
  const auto calibration = pipeline::CalibrateBoard(
      board, photos, options.outputs.front().stem().string(), calibrate, context.console);
  for (const fs::path& output : options.outputs) pipeline::WriteCameraFile(output, calibration);
  SayModels(calibration, context.console);
  SayCamera(calibration, context.console);
  nlohmann::ordered_json json = calib::SummaryJson(calibration);
  json["contents"] = capture::JsonOf(photos.contents);
  const int code = ValidateMade(calibration, context, json);
  context.EmitJson(json);
  return code;
}

}  // namespace

void AddCalibrateBoardCommand(CLI::App& calibrate) {
  AddCommand(
      calibrate, "board",
      "Calibrate one camera from photos of a board, and validate it; exit 1 when a test fails",
      "dtr calibrate board photos/ --board chessboard:9x6:25mm -o left.json -o left.yml",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<CalibrateBoardArguments>();
        command
            .add_option("PHOTOS", options->photos, "Folder of photos of the board, one camera's")
            ->required();
        command
            .add_option("-o,--output", options->outputs,
                        "The calibration, by its name: .json with its observations, .yml OpenCV's, "
                        ".txt COLMAP's cameras.txt; may be given more than once")
            ->required()
            ->type_name("FILE");
        command
            .add_option(
                "--board", options->board,
                "chessboard:WxH:SQUARE (W x H inner corners) or "
                "charuco:WxH:SQUARE:MARKER[:DICTIONARY][:inverted] (W x H squares); lengths "
                "in mm, cm, m, or without a unit in your own")
            ->required()
            ->type_name("BOARD");
        command
            .add_option(
                "--model", options->model,
                "Camera model: pinhole, brown4, brown5, brown8, fisheye, or auto, by photos "
                "held out [auto]")
            ->type_name("MODEL");
        command
            .add_option("--images", options->images, "Only photos of these names, as 'left*.jpg'")
            ->type_name("PATTERN");
        command
            .add_option(
                "--detector", options->detector,
                "How chessboards are found: quads, sectors (slower, for blur and noise), or "
                "auto, sectors where quads find nothing [auto]")
            ->check(CLI::IsMember({"auto", "quads", "sectors"}))
            ->type_name("NAME");
        command
            .add_option("--loss", options->loss,
                        "robust: outliers are named and left out; quadratic: every corner counts "
                        "[robust]")
            ->check(CLI::IsMember({"robust", "quadratic"}))
            ->type_name("NAME");
        return [options](const Context& context) { return RunCalibrateBoard(*options, context); };
      });
}

}  // namespace dtr::cli
