#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "capture/ingest.h"
#include "cli/command.h"
#include "cli/number_checks.h"
#include "dtr/base/error.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/set_io.h"
#include "pipeline/detail/cameras/camera_distortion.h"
#include "pipeline/detail/cameras/camera_files.h"
#include "pipeline/detail/cameras/known_poses.h"
#include "pipeline/detail/photos/import_photos.h"
#include "pipeline/detail/run/recorded_notes.h"
#include "pipeline/import.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ImportArguments {
  fs::path cameras, output;
  std::string format, depth_kind;
  pipeline::ImportOptions import;
  std::string held_out;
  bool allow_missing = false, force = false;
};

// What of the folder of images the cameras use.
capture::FolderContents ContentsFor(const ImportArguments& options, const io::CameraList& list) {
  capture::FolderContents contents;
  const std::filesystem::path& images = options.import.images_dir;
  if (std::filesystem::is_directory(images)) contents = capture::ContentsOfFiles(images, true);
  contents.Use("other_files");  // the cameras and what else belongs to a project
  contents.photos = static_cast<int>(list.cameras.size());
  for (const io::NamedCamera& camera : list.cameras) {
    contents.masks += !camera.mask_file.empty();
    contents.depth_maps +=
        !options.import.depth_dir.empty() && !options.import.held_out.contains(camera.name);
  }
  // Depth maps that are found by name may lie among the photos.
  if (options.import.depth_dir == images) return contents;
  const std::vector<std::string> unused = pipeline::PhotosWithoutCamera(list, images);
  if (!unused.empty()) {
    contents.Ignore("unused_photos", "other images",
                    "no camera is of them, first " + unused.front(), "",
                    static_cast<int>(unused.size()));
  }
  return contents;
}

void FindMasks(ImportArguments& options, pipeline::CamerasFromFile& cameras, Progress& progress) {
  if (options.import.mask_dir.empty()) {
    options.import.mask_dir = cameras.mask_dir;
    return;
  }
  pipeline::NameMasks(options.import.mask_dir, options.import.images_dir, cameras.list);
  const auto bare = std::count_if(cameras.list.cameras.begin(), cameras.list.cameras.end(),
                                  [](const auto& camera) { return camera.mask_file.empty(); });
  if (bare > 0) {
    progress.Note(fmt::format("{} of {} photos have no mask: all of them is used", bare,
                              cameras.list.cameras.size()));
  }
}

// --holdout, else what the file says.
std::set<std::string> HeldOut(const ImportArguments& options,
                              const pipeline::CamerasFromFile& cameras, Progress& progress) {
  if (!cameras.held_out) return pipeline::NamesHeldOut(options.held_out, cameras.list);
  if (!options.held_out.empty()) {
    progress.Note("--holdout replaces train_filenames, test_filenames and val_filenames of " +
                  options.cameras.string());
    return pipeline::NamesHeldOut(options.held_out, cameras.list);
  }
  progress.Note(fmt::format("{}: {} views held out, as its test_filenames and val_filenames say",
                            options.cameras.string(), cameras.held_out->size()));
  return *cameras.held_out;
}

// The unit that the file gives, where the command gives none; depth maps that nothing reads.
void SettleDepth(ImportArguments& options, const pipeline::CamerasFromFile& cameras,
                 Progress& progress) {
  const auto& list = cameras.list.cameras;
  const auto maps = std::count_if(list.begin(), list.end(),
                                  [](const auto& named) { return !named.depth_file.empty(); });
  if (options.import.depth_dir.empty()) {
    if (maps > 0) {
      progress.Note(
          fmt::format("{}: {} depth maps that it names are not used; --depth DIR takes "
                      "them",
                      options.cameras.string(), maps));
    }
    return;
  }
  if (!cameras.depth_unit) return;
  if (options.import.depth_unit && *options.import.depth_unit != *cameras.depth_unit) {
    progress.Note(fmt::format("--depth-unit {} replaces the {} of {}", *options.import.depth_unit,
                              *cameras.depth_unit, options.cameras.string()));
  }
  if (!options.import.depth_unit) options.import.depth_unit = cameras.depth_unit;
}

// Points of a set without depth, where the cameras come without: COLMAP finds them.
void FindPoints(const ImportArguments& options, const Context& context,
                pipeline::CamerasFromFile& cameras, Progress& progress) {
  if (!options.import.depth_dir.empty() || (cameras.points && !cameras.points->points.empty())) {
    return;
  }
  if (!cameras.points_file.empty()) {
    progress.Note(
        fmt::format("{}: points of {} are not used, they do not say which photo sees them",
                    options.cameras.string(), cameras.points_file));
  }
  cameras.list = io::RecentreWorld(std::move(cameras.list));
  const capture::Capture photos = pipeline::PhotosOf(cameras.list, options.import);
  pipeline::CalibrateOptions calibrate;
  for (const capture::Photo& photo : photos.photos) {
    calibrate.held_out.push_back(options.import.held_out.contains(photo.name));
  }
  calibrate.threads = context.common.threads;
  calibrate.seed = context.common.seed;
  calibrate.memory_gb = options.import.memory_gb;
  calibrate.poses = options.cameras;
  const TemporaryFolder workspace;
  cameras.points =
      pipeline::TriangulatedPoints(cameras.list, photos, calibrate, workspace.path(), progress);
}

Json ResultJson(const ImportArguments& options, const pipeline::CamerasFromFile& cameras,
                const io::AlphaTotals& alpha, const std::vector<std::string>& notes) {
  Json json = {{"views", cameras.list.cameras.size()},
               {"held_out", options.import.held_out.size()},
               {"alpha",
                {{"masked_photos", alpha.masked_photos},
                 {"partial_photos", alpha.partial_photos},
                 {"partial_px", alpha.partial_px}}},
               {"skipped", Json::array()},
               {"notes", notes}};
  for (const auto& [name, reason] : cameras.skipped) {
    json["skipped"].push_back({{"name", name}, {"reason", reason}});
  }
  return json;
}

int RunImport(ImportArguments options, const Context& context) {
  pipeline::RecordedNotes progress(context.console);
  auto cameras = pipeline::ReadCameraFile(options.cameras, options.format,
                                          {options.import.images_dir, options.import.depth_dir,
                                           options.import.mask_dir, options.allow_missing});
  for (const std::string& note : cameras.notes) progress.Note(note);
  FindMasks(options, cameras, progress);
  if (options.depth_kind == "z") options.import.depth_kind = DepthKind::kPlaneZ;
  if (options.depth_kind == "ray") options.import.depth_kind = DepthKind::kRayDistance;
  SettleDepth(options, cameras, progress);
  options.import.held_out = HeldOut(options, cameras, progress);
  options.import.photo_grid = cameras.list.photo_grid;
  options.import.distortion_of = pipeline::DistortionOf;
  options.import.threads = context.common.threads;
  io::SetWriter::RequireTarget(options.output, options.force);
  const capture::FolderContents contents = ContentsFor(options, cameras.list);
  context.console.Note(capture::LineOf(contents));
  FindPoints(options, context, cameras, progress);
  const io::AlphaTotals alpha =
      pipeline::ImportSet(cameras.list, options.import, options.output, options.force,
                          cameras.points ? &*cameras.points : nullptr, progress);
  context.console.Say(fmt::format("{}: {} views, {} held out", options.output.string(),
                                  cameras.list.cameras.size(), options.import.held_out.size()));
  context.EmitJson(
      capture::JsonWith(contents, ResultJson(options, cameras, alpha, progress.lines()).dump()));
  return kDone;
}

}  // namespace

void AddImportCommand(CLI::App& app) {
  AddCommand(
      app, "import", "Make a set from others' cameras, images and depth maps",
      "dtr import --cameras sparse/ --format colmap --images images/ --depth depth/ -o scene.dtr",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<ImportArguments>();
        command.add_option("--cameras", options->cameras, "cameras.json, or what --format says")
            ->required()
            ->type_name("FILE");
        command.add_option("--format", options->format, "Format of --cameras [by its name]")
            ->check(CLI::IsMember(pipeline::CameraFormats()));
        command.add_option("--images", options->import.images_dir, "Folder of the images")
            ->required()
            ->type_name("DIR");
        CLI::Option* depth =
            command
                .add_option("--depth", options->import.depth_dir,
                            "Folder of depth maps NAME.exr, .pfm, .png, .tif or .npy")
                ->type_name("DIR");
        command
            .add_option("--depth-kind", options->depth_kind,
                        "z: along the optical axis; ray: distance from the camera")
            ->check(CLI::IsMember({"z", "ray"}))
            ->needs(depth);
        command
            .add_option("--depth-unit", options->import.depth_unit,
                        "Scene units per number of a depth file (0.001: millimetres)")
            ->check(kPositive)
            ->needs(depth)
            ->type_name("U");
        command
            .add_option("--masks", options->import.mask_dir,
                        "Folder of masks, dark where a photo is not to be used: as --cameras names "
                        "them, else NAME.png, NAME.EXT.png or NAME_mask.png")
            ->type_name("DIR");
        AddMemoryOption(command, options->import.memory_gb,
                        "Memory for views that are read at a time [4]");
        command.add_flag("--allow-missing", options->allow_missing,
                         "Leave out cameras whose photo is not there, instead of failing");
        command
            .add_option("--holdout", options->held_out, "Views kept without depth, to measure with")
            ->type_name("every:N|NAME,...");
        command.add_option("-o,--output", options->output, "The set to write, NAME.dtr")
            ->required()
            ->type_name("SET.dtr");
        command.add_flag("--force", options->force, "Replace a set that exists");
        return [options](const Context& context) { return RunImport(*options, context); };
      });
}

}  // namespace dtr::cli
