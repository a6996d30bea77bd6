#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "capture/ingest.h"
#include "cli/command.h"
#include "cli/number_checks.h"
#include "cli/pipeline/camera_files.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/import_views.h"

namespace dtr::cli {
namespace {

struct Options {
  std::filesystem::path cameras, output;
  std::string format, depth_kind;
  io::ImportOptions import;
  std::string held_out;
  bool force = false;
};

bool LiesIn(const std::filesystem::path& folder, const std::filesystem::path& above) {
  std::error_code ignored;
  const auto relative = std::filesystem::relative(folder, above, ignored);
  return !folder.empty() && !relative.empty() && *relative.begin() != "..";
}

// What of the folder of images the cameras use.
capture::FolderContents ContentsFor(const Options& options, const io::CameraList& list) {
  capture::FolderContents contents;
  const std::filesystem::path& images = options.import.images_dir;
  if (std::filesystem::is_directory(images)) contents = capture::ContentsOfFiles(images, true);
  contents.Use("other_files");  // the cameras and what else belongs to a project
  const int used = static_cast<int>(list.cameras.size());
  for (const io::NamedCamera& camera : list.cameras) {
    contents.masks += !camera.mask_file.empty();
    contents.depth_maps +=
        !options.import.depth_dir.empty() && !options.import.held_out.contains(camera.name);
  }
  const int others = contents.photos - used -
                     (LiesIn(options.import.depth_dir, images) ? contents.depth_maps : 0) -
                     (LiesIn(options.import.mask_dir, images) ? contents.masks : 0);
  if (others > 0) {
    contents.Ignore("unused_photos", "other images", "no camera names them as its photo", "",
                    others);
  }
  contents.photos = used;
  return contents;
}

int RunImport(Options options, const Context& context) {
  auto cameras =
      pipeline::ReadCameraFile(options.cameras, options.format, options.import.images_dir);
  if (options.import.mask_dir.empty()) {
    options.import.mask_dir = cameras.mask_dir;
  } else {
    pipeline::NameMasks(options.import.mask_dir, options.import.images_dir, cameras.list);
    const auto bare = std::count_if(cameras.list.cameras.begin(), cameras.list.cameras.end(),
                                    [](const auto& camera) { return camera.mask_file.empty(); });
    if (bare > 0) {
      context.console.Note(fmt::format("{} of {} photos have no mask: all of them is used", bare,
                                       cameras.list.cameras.size()));
    }
  }
  if (options.depth_kind == "z") options.import.depth_kind = DepthKind::kPlaneZ;
  if (options.depth_kind == "ray") options.import.depth_kind = DepthKind::kRayDistance;
  options.import.held_out = pipeline::NamesHeldOut(options.held_out, cameras.list);
  options.import.threads = context.common.threads;
  const capture::FolderContents contents = ContentsFor(options, cameras.list);
  context.console.Note(capture::LineOf(contents));
  const io::AlphaTotals alpha =
      io::ImportSet(cameras.list, options.import, options.output, options.force,
                    cameras.points ? &*cameras.points : nullptr, context.console);
  context.console.Say(fmt::format("{}: {} views, {} held out", options.output.string(),
                                  cameras.list.cameras.size(), options.import.held_out.size()));
  const nlohmann::ordered_json json{{"views", cameras.list.cameras.size()},
                                    {"alpha",
                                     {{"masked_photos", alpha.masked_photos},
                                      {"partial_photos", alpha.partial_photos},
                                      {"partial_px", alpha.partial_px}}}};
  context.EmitJson(capture::JsonWith(contents, json.dump()));
  return kDone;
}

}  // namespace

void AddImportCommand(CLI::App& app) {
  AddCommand(
      app, "import", "Make a set from others' cameras, images and depth maps",
      "dtr import --cameras sparse/ --format colmap --images images/ --depth depth/ -o scene.dtr",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<Options>();
        command.add_option("--cameras", options->cameras, "cameras.json, or what --format says")
            ->required()
            ->type_name("FILE");
        command.add_option("--format", options->format, "Format of --cameras [by its name]")
            ->check(CLI::IsMember(pipeline::CameraFormats()));
        command.add_option("--images", options->import.images_dir, "Folder of undistorted images")
            ->required()
            ->type_name("DIR");
        CLI::Option* depth = command
                                 .add_option("--depth", options->import.depth_dir,
                                             "Folder of depth maps NAME.exr, .pfm, .png or .tif")
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
