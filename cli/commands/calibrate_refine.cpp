#include <fmt/format.h>

#include <filesystem>

#include "calib/bundle/one_position.h"
#include "calib/bundle/refine.h"
#include "calib/colmap/model_io.h"
#include "cli/command.h"
#include "cli/metre_options.h"
#include "dtr/base/error.h"
#include "pipeline/core/camera_file.h"
#include "pipeline/core/metres.h"
#include "pipeline/core/model_grid.h"

namespace dtr::cli {
namespace {

struct CalibrateRefineArguments {
  std::filesystem::path model, output, lens, gps;
  bool separate = false, covariance = false;
  MetreWords metres;
};

void SayRefined(const calib::Refined& refined, Console& console) {
  for (const auto& candidate : refined.candidates) {
    console.Say(
        fmt::format("{:<26} held-out points: {:.4f} px", candidate.name, candidate.held_out_px));
  }
  if (refined.held_out_observations > 0) {
    console.Say(fmt::format("{} held-out observations: as given {:.4f} px, adjusted {:.4f} px",
                            refined.held_out_observations, refined.given_px, refined.adjusted_px));
  }
  if (!refined.changed) {
    console.Say("left as given: " + refined.reason);
  } else {
    console.Say(
        fmt::format("refined, intrinsics {}: RMS {:.4f} px, sigma {:.4f} px per "
                    "coordinate, {} points dropped",
                    NameOf(*refined.lens), refined.adjusted.rms_px, refined.adjusted.sigma_px,
                    refined.points_dropped));
  }
  if (const std::string remark = calib::RemarkOn(refined); !remark.empty()) console.Say(remark);
  if (const std::string line = calib::OnePositionLine(refined.model); !line.empty())
    console.Say(line);
}

pipeline::RefinedInMetres HoldMetres(const CalibrateRefineArguments& options,
                                     const pipeline::MetreOptions& metres,
                                     const calib::SfmModel& model,
                                     const calib::RefineOptions& refine) {
  const std::vector<std::string> names = calib::ImageNames(model);
  pipeline::RequireCameras(metres, names, "the model");
  pipeline::PhotoPositions places;
  if (metres.gps) {
    places = pipeline::ReadPhotoPositions(options.gps, names);
    pipeline::RequirePlaces(places, options.gps.string(), "the model");
  }
  return pipeline::RefineInMetres(model, metres, places, refine);
}

// The refined model is of the same pixels as the given one.
void WriteRefined(const CalibrateRefineArguments& options, const std::filesystem::path& from,
                  const calib::SfmModel& model) {
  colmap::WriteModel(options.output, model, colmap::Format::kBinary);
  if (pipeline::GridOfModel(from) == PhotoGrid::kUpright) pipeline::MarkUpright(options.output);
}

int RunRefine(const CalibrateRefineArguments& options, const Context& context) {
  colmap::RequireNoModel(options.output);
  const pipeline::MetreOptions metres = MetreOptionsFrom(!options.gps.empty(), options.metres);
  const std::filesystem::path model_folder = colmap::ModelFolderIn(options.model);
  std::vector<std::string> notes;
  const calib::SfmModel model = colmap::ReadModel(model_folder, &notes);
  for (const std::string& note : notes) context.console.Note(note);
  calib::RefineOptions refine;
  refine.separate_lenses = options.separate;
  refine.covariance = options.covariance;
  refine.determined = options.model.string();
  refine.seed = context.common.seed;
  refine.progress = &context.console;
  context.console.Stage("bundle adjustment", 0);
  if (!options.lens.empty()) {
    const calib::LensCamera lens = pipeline::ReadLens(options.lens);
    refine.known_lenses.emplace();
    for (const auto& [id, camera] : model.cameras) {
      refine.known_lenses->emplace(id, pipeline::LensFor(lens, camera.width_px, camera.height_px,
                                                         fmt::format("camera {}", id)));
    }
  }
  if (metres.any()) {
    const pipeline::RefinedInMetres in_metres = HoldMetres(options, metres, model, refine);
    SayRefined(in_metres.refined, context.console);
    for (const std::string& line : in_metres.lines) context.console.Say(line);
    WriteRefined(options, model_folder, in_metres.refined.model);
    context.EmitJson(pipeline::ToJson(in_metres));
    return kDone;
  }
  const calib::Refined refined = calib::Refine(model, refine);
  SayRefined(refined, context.console);
  WriteRefined(options, model_folder, refined.model);
  context.EmitJson(calib::ToJson(refined));
  return kDone;
}

}  // namespace

CLI::Option* AddLensOption(CLI::App& command, std::filesystem::path& lens) {
  return command
      .add_option(
          "--lens", lens,
          "The intrinsics of all photos, known: a .json of `dtr calibrate board`, a .yml or "
          ".xml of OpenCV, ROS, Kalibr or ORB-SLAM, a .cameramodel of mrcal or a cameras.txt; it "
          "is not changed")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
}

void AddCalibrateRefineCommand(CLI::App& calibrate) {
  AddCommand(
      calibrate, "refine",
      "Bundle adjustment of a COLMAP model, used where held-out observations gain",
      "dtr calibrate refine sparse/0 -o refined/ --lens camera.json",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<CalibrateRefineArguments>();
        command.add_option("MODEL", options->model, "Folder of the COLMAP model")
            ->required()
            ->check(CLI::ExistingDirectory);
        command.add_option("-o,--output", options->output, "Folder for the new model")
            ->required()
            ->type_name("DIR");
        AddLensOption(command, options->lens);
        CLI::Option* gps =
            command
                .add_option(
                    "--gps", options->gps,
                    "Folder of the model's photos, whose EXIF says where they were "
                    "taken: these positions constrain the solve, and the model gets metres east, "
                    "north and up")
                ->check(CLI::ExistingDirectory)
                ->type_name("PHOTOS");
        AddMetreOptions(command, *gps, options->metres);
        command.add_flag("--separate-lenses", options->separate,
                         "Every photo intrinsics of its own, as with a zoom that was moved");
        command.add_flag("--covariance", options->covariance,
                         "Add what is uncertain about every pose and camera to --json, where "
                         "the model is refined");
        return [options](const Context& context) { return RunRefine(*options, context); };
      });
}

}  // namespace dtr::cli
