#include <fmt/format.h>

#include <filesystem>

#include "calib/colmap/model_io.h"
#include "capture/ingest.h"
#include "capture/split_panoramas.h"
#include "capture/store.h"
#include "cli/command.h"
#include "cli/commands/calibrate_scale.h"
#include "cli/metre_options.h"
#include "cli/not_registered.h"
#include "cli/sfm_options.h"
#include "dtr/base/error.h"
#include "dtr/base/work_folder.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/core/camera_file.h"
#include "pipeline/core/model_grid.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;

struct CalibrateArguments {
  fs::path photos, output;
  double memory_gb = 4;
  pipeline::SfmChoice sfm;
  bool refine = true, gps = false;
  fs::path lens;
  MetreWords metres;
};

int RunCalibratePhotos(const CalibrateArguments& options, const Context& context) {
  context.console.KeepsWork();
  const pipeline::MetreOptions metres = MetreOptionsFrom(options.gps, options.metres);
  colmap::RequireNoModel(options.output);
  pipeline::CalibrateOptions calibrate;
  // Before any photo is read: what is missing or wrong must not cost their time.
  if (!options.lens.empty()) calibrate.lens = pipeline::ReadLens(options.lens);
  pipeline::RequireCalibration({}, "", options.sfm);
  auto photos =
      capture::IngestPhotos(options.photos, {.memory_gb = options.memory_gb}, context.console);
  for (const capture::Skipped& photo : photos.skipped) {
    context.console.Note(fmt::format("skipped: {}: {}", photo.name, photo.reason));
  }
  if (capture::ArePanoramas(photos, capture::PanoramaUse::kAuto, &context.console)) {
    throw UsageError(fmt::format(
        "{}: holds 360 degree panoramas; split them first: dtr capture {} -o DIR, then dtr "
        "calibrate photos DIR",
        options.photos.string(), options.photos.string()));
  }
  capture::RequireEnoughPhotos(photos, options.photos);
  pipeline::RequireMetres(metres, photos, options.photos.string());
  calibrate.metres = metres;
  calibrate.seed = context.common.seed;
  calibrate.memory_gb = options.memory_gb;
  calibrate.sfm = options.sfm;
  calibrate.refine = options.refine;
  calibrate.determined = options.photos.string();
  // The workspace stays: it holds COLMAP's arguments, logs and database, and lets a run continue.
  const fs::path workspace = options.output / "workspace";
  fs::create_directories(workspace);
  const FileLock lock = WorkFolder::Lock(workspace, capture::kCalibrationKind);
  const auto calibrated = pipeline::CalibratePhotos(photos, calibrate, workspace, context.console);
  colmap::WriteModel(options.output, calibrated.model, colmap::Format::kBinary);
  pipeline::MarkUpright(options.output);

  context.console.Say(fmt::format("{}: {} of {} photos have a camera; {} points",
                                  options.output.string(), calibrated.model.images.size(),
                                  photos.photos.size(), calibrated.model.points.size()));
  SayNotRegistered(calibrated.not_registered, calibrated.why_not_registered, context.console);
  if (const auto& sfm = calibrated.report.sfm; sfm && !sfm->doubt.empty()) {
    context.console.Say("  calibration: FAILED: " + sfm->doubt);
  }
  context.EmitJson(pipeline::ToJson(calibrated, photos.contents));
  return kDone;
}

}  // namespace

void AddCalibrateCommand(CLI::App& app) {
  CLI::App* calibrate = app.add_subcommand("calibrate", "Find cameras");
  calibrate->require_subcommand(1);
  if constexpr (DTR_WITH_BOARDS) AddCalibrateBoardCommand(*calibrate);
  AddCalibrateRefineCommand(*calibrate);
  if constexpr (DTR_WITH_BOARDS) AddCalibrateRigCommand(*calibrate);
  if constexpr (DTR_WITH_METRES) AddCalibrateScaleCommand(*calibrate);
  AddCommand(*calibrate, "photos", "Calibrate a folder of photos by structure from motion",
             "dtr calibrate photos photos/ -o calibration/", [](CLI::App& command) -> Action {
               auto options = std::make_shared<CalibrateArguments>();
               command.add_option("PHOTOS", options->photos, "Folder of photos")->required();
               command
                   .add_option("-o,--output", options->output,
                               "Folder for the COLMAP model and its workspace")
                   ->required()
                   ->type_name("DIR");
               command.add_option("--memory", options->memory_gb, "Memory to stay within [4]")
                   ->check(CLI::Range(0.5, 4096.0))
                   ->type_name("GB");
               CLI::Option* no_refine =
                   command.add_flag("!--no-refine", options->refine,
                                    "Take COLMAP's cameras as they are, without bundle adjustment");
               CLI::Option* camera_per = AddSfmOptions(command, options->sfm);
               // A lens that is given replaces COLMAP's: poses and points must follow it.
               AddLensOption(command, options->lens)->excludes(no_refine)->excludes(camera_per);
               CLI::Option* gps = AddGpsFlag(command, options->gps)->excludes(no_refine);
               AddMetreOptions(command, *gps, options->metres)->excludes(no_refine);
               return [options](const Context& context) {
                 return RunCalibratePhotos(*options, context);
               };
             });
}

}  // namespace dtr::cli
