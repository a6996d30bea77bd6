#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/files/summary_json.h"
#include "calib/validation/boards.h"
#include "capture/contents_json.h"
#include "cli/command.h"
#include "cli/commands/validate_calibration.h"
#include "cli/output_file.h"
#include "dtr/base/error.h"
#include "pipeline/boards/calibrate_rig.h"
#include "pipeline/core/camera_file.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

struct CalibrateRigArguments {
  fs::path folder;
  std::vector<fs::path> outputs;
  std::string board, model = "auto", loss = "robust", lenses = "free", clocks = "synchronised";
  std::vector<std::string> given;
};

std::optional<calib::BoardModel> RigModelFrom(const std::string& name) {
  if (name == "auto") return std::nullopt;
  const auto model = calib::BoardModelFromName(name);
  if (!model) throw UsageError("--model " + name + ": expected auto or the name of a model");
  return model;
}

std::string DelayText(const std::string& camera, const std::string& first, double frames,
                      double sigma) {
  return fmt::format("{}: its photos are {:.4f} +- {:.2g} frames {} {}'s", camera, std::abs(frames),
                     sigma, frames < 0 ? "before" : "after", first);
}

// When the cameras take their images: what was found, or what speaks against one clock.
void SayDelays(const calib::Calibration& calibration, const pipeline::RigSummary& summary,
               Console& console) {
  const std::string& first = calibration.cameras.front().name;
  for (const calib::CalibratedCamera& camera : calibration.cameras) {
    if (!camera.delay) continue;
    console.Say(DelayText(camera.name, first, camera.delay->frames, camera.delay->sigma) +
                (camera.delay->corners_moved ? "; its corners are moved by as much"
                                             : ", which may be chance"));
  }
  for (size_t c = 1; c < summary.delays.size(); ++c) {
    const auto& delay = summary.delays[c];
    if (!delay || std::abs(delay->frames) <= calib::kDelaySigmas * delay->sigma) continue;
    console.Say(
        DelayText(calibration.cameras[c].name, first, delay->frames, delay->sigma) +
        "; if the board moved from frame to frame at one pace, --clocks free allows for that");
  }
  if (summary.passes > 1) {
    console.Say(fmt::format("delays settled after {} solves", summary.passes));
  }
  const calib::BoardLimits limits;
  if (summary.unsteady.p < limits.min_p && summary.unsteady.amplitude_px > limits.max_pattern_px) {
    console.Say(fmt::format(
        "the cameras have no common rate: a delay of each photo's own, beyond one per camera, "
        "explains {:.3f} px RMS per coordinate; the stated uncertainties are too small",
        summary.unsteady.amplitude_px));
  }
}

void SayRig(const calib::Calibration& calibration, const pipeline::RigSummary& summary,
            Console& console) {
  for (const calib::CalibratedCamera& camera : calibration.cameras) {
    console.Say(fmt::format("{}: {}, {} x {} px, RMS {:.4f} px", camera.name,
                            calib::NameOf(camera.model), camera.camera.width_px,
                            camera.camera.height_px, camera.rms_px));
    const auto names = calib::FreeParameterNames(camera.model);
    for (size_t i = 0; i < names.size(); ++i) {
      const auto at = static_cast<long>(i);
      console.Say(fmt::format("  {:<7} {:>14.6g} +- {:.2g}", names[i], camera.camera.params[i],
                              std::sqrt(camera.covariance(at, at))));
    }
    if (camera.place_covariance.size() == 0) continue;
    const Eigen::Vector3d t = camera.cam_from_rig.translation;
    const Eigen::VectorXd sigma = camera.place_covariance.diagonal().cwiseSqrt();
    const Eigen::AngleAxisd turn(camera.cam_from_rig.rotation);
    const Eigen::Vector3d w = turn.angle() * turn.axis();
    console.Say(fmt::format("  rotation     {:.5f}, {:.5f}, {:.5f} rad +- {:.1g}, {:.1g}, {:.1g}",
                            w.x(), w.y(), w.z(), sigma[0], sigma[1], sigma[2]));
    console.Say(fmt::format("  translation  {:.5g}, {:.5g}, {:.5g} +- {:.1g}, {:.1g}, {:.1g}",
                            t.x(), t.y(), t.z(), sigma[3], sigma[4], sigma[5]));
  }
  for (const std::string& line : summary.simpler) console.Say("simpler camera model: " + line);
  for (const std::string& name : summary.flipped) {
    console.Say("counted from the other end, repaired: " + name);
  }
  for (const calib::CalibratedView& view : calibration.views) {
    if (view.outliers.empty()) continue;
    console.Say(
        fmt::format("outliers: {}: corners {}", view.seen.name, fmt::join(view.outliers, ", ")));
  }
  console.Say(fmt::format("left out: {} images, see the file", calibration.left_out.size()));
  console.Say(
      fmt::format("{} frames, {} views, {} corners, {} outliers; RMS {:.4f} px, sigma "
                  "{:.4f} px per coordinate",
                  summary.frames, calibration.views.size(), summary.corners, summary.outliers,
                  summary.rms_px, summary.sigma_px));
}

int RunCalibrateRig(const CalibrateRigArguments& options, const Context& context) {
  const calib::Board board = calib::BoardFromText(options.board);
  for (const fs::path& output : options.outputs) {
    RequireOutputFile(output, "-o", {".json", ".yml", ".yaml", ".txt"});
  }
  pipeline::RigCalibrationOptions calibrate;
  calibrate.model = RigModelFrom(options.model);
  calibrate.solve.loss =
      options.loss == "quadratic" ? calib::Loss::kQuadratic : calib::Loss::kRobust;
  calibrate.fixed_lenses = options.lenses == "fixed";
  calibrate.free_running = options.clocks == "free";
  calibrate.seed = context.common.seed;
  std::map<std::string, calib::LensCamera> known;
  for (const std::string& given : options.given) {
    const size_t at = given.find('=');
    if (at == std::string::npos || at == 0) {
      throw UsageError("--camera " + given + ": expected NAME=FILE");
    }
    const std::string file = given.substr(at + 1);
    const std::string name = given.substr(0, at);
    calibrate.given[name] = pipeline::GivenLens(pipeline::ReadLens(file), file);
    known.insert_or_assign(name, *calibrate.given[name].given);
  }
  const auto photos = pipeline::ReadRigPhotos(options.folder, board, {}, context.console, known);
  pipeline::RigSummary summary;
  const auto calibration =
      pipeline::CalibrateRig(board, photos, calibrate, &summary, context.console);
  for (const fs::path& output : options.outputs) pipeline::WriteRigFile(output, calibration);
  SayRig(calibration, summary, context.console);
  SayDelays(calibration, summary, context.console);
  nlohmann::ordered_json json = calib::SummaryJson(calibration);
  json["contents"] = capture::JsonOf(photos.contents);
  const int code = ValidateMade(calibration, context, json);
  context.EmitJson(json);
  return code;
}

}  // namespace

void AddCalibrateRigCommand(CLI::App& calibrate) {
  AddCommand(
      calibrate, "rig",
      "Use a board to calibrate cameras fixed to each other, and validate them; exit 1 if a test "
      "fails",
      "dtr calibrate rig pairs/ --board chessboard:9x6:25mm -o rig.json -o rig.yml",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<CalibrateRigArguments>();
        command
            .add_option("DIR", options->folder,
                        "Sub-folders, one per camera, with photos of equal names; or photos named "
                        "CAMERA and a number, as left01.jpg; or videos, one per camera, with or "
                        "without timestamps.csv")
            ->required();
        command
            .add_option("-o,--output", options->outputs,
                        "The calibration, by its name: .json with its observations, .yml of two "
                        "cameras as OpenCV's stereo programs take it, .txt COLMAP's cameras.txt; "
                        "may be given more than once")
            ->required()
            ->type_name("FILE");
        command.add_option("--board", options->board, "As calibrate board takes it")
            ->required()
            ->type_name("BOARD");
        command
            .add_option(
                "--model", options->model,
                "Camera model of every camera: pinhole, brown4, brown5, brown8, fisheye, or "
                "auto, each camera's own by photos held out [auto]")
            ->type_name("MODEL");
        command
            .add_option("--camera", options->given,
                        "Lens of a camera that is calibrated already, a .json, .yml or .txt file; "
                        "all cameras or none")
            ->type_name("NAME=FILE");
        command
            .add_option("--lenses", options->lenses,
                        "free: solved for together with the rig; fixed: as given by --camera, or "
                        "as each camera's own boards give them [free; fixed with --camera]")
            ->check(CLI::IsMember({"free", "fixed"}))
            ->type_name("NAME");
        command
            .add_option("--clocks", options->clocks,
                        "synchronised: photos of a frame are taken at one time; free: each camera "
                        "takes its own when it likes, at the same rate, and its delay is found "
                        "from the board's motion [synchronised]")
            ->check(CLI::IsMember({"synchronised", "free"}))
            ->type_name("NAME");
        command
            .add_option("--loss", options->loss,
                        "robust: outliers are named and left out; quadratic: every corner counts "
                        "[robust]")
            ->check(CLI::IsMember({"robust", "quadratic"}))
            ->type_name("NAME");
        return [options](const Context& context) { return RunCalibrateRig(*options, context); };
      });
}

}  // namespace dtr::cli
