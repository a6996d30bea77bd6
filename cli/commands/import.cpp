#include "pipeline/import/import.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "calib/bundle/refine.h"
#include "capture/contents_json.h"
#include "cli/command.h"
#include "cli/number_checks.h"
#include "pipeline/core/camera_file.h"

namespace dtr::cli {
namespace {

using Json = nlohmann::ordered_json;

Json ResultJson(const pipeline::ImportReport& report) {
  Json json = {{"views", report.views},
               {"held_out", report.held_out},
               {"alpha",
                {{"masked_photos", report.alpha.masked_photos},
                 {"partial_photos", report.alpha.partial_photos},
                 {"partial_px", report.alpha.partial_px}}},
               {"skipped", Json::array()},
               {"notes", report.notes}};
  for (const auto& [name, reason] : report.skipped) {
    json["skipped"].push_back({{"name", name}, {"reason", reason}});
  }
  if (const auto& adjustment = report.calibration.bundle_adjustment) {
    json["bundle_adjustment"] = Json::parse(calib::ToJson(adjustment->refined));
  }
  json["contents"] = capture::JsonOf(report.contents);
  return json;
}

int RunImport(pipeline::ImportRequest request, const std::string& depth_kind,
              const Context& context) {
  if (depth_kind == "z") request.depth_kind = DepthKind::kPlaneZ;
  if (depth_kind == "ray") request.depth_kind = DepthKind::kRayDistance;
  request.seed = context.common.seed;
  const pipeline::ImportReport report = pipeline::Import(request, context.console);
  context.console.Say(fmt::format("{}: {} views, {} held out", request.output.string(),
                                  report.views, report.held_out));
  context.EmitJson(ResultJson(report));
  return kDone;
}

}  // namespace

void AddImportCommand(CLI::App& app) {
  AddCommand(
      app, "import", "Make a set from others' cameras, images and depth maps",
      "dtr import --cameras sparse/ --format colmap --images images/ --depth depth/ -o scene.dtr",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<pipeline::ImportRequest>();
        auto depth_kind = std::make_shared<std::string>();
        command
            .add_option("cameras,--cameras", options->cameras,
                        "A file or folder of cameras, of any program that --format names")
            ->required()
            ->type_name("FILE");
        command.add_option("--format", options->format, "Format of --cameras [by its content]")
            ->check(CLI::IsMember(pipeline::CameraFormats()));
        command
            .add_option("--images", options->images,
                        "Folder of the images; a capture knows its own")
            ->type_name("DIR");
        CLI::Option* depth =
            command
                .add_option("--depth", options->depth,
                            "Folder of depth maps NAME.exr, .pfm, .png, .tif or .npy")
                ->type_name("DIR");
        command
            .add_option("--depth-kind", *depth_kind,
                        "z: along the optical axis; ray: distance from the camera")
            ->check(CLI::IsMember({"z", "ray"}))
            ->needs(depth);
        command
            .add_option("--depth-unit", options->depth_unit,
                        "Scene units per number of a depth file (0.001: millimetres)")
            ->check(kPositive)
            ->needs(depth)
            ->type_name("U");
        command
            .add_option("--masks", options->masks,
                        "Folder of masks, dark where a photo is not to be used: as --cameras names "
                        "them, else NAME.png, NAME.EXT.png or NAME_mask.png")
            ->type_name("DIR");
        command.add_flag("--completion,!--no-completion", options->completion,
                         "With --depth: complete depth where there is none, so that images are "
                         "whole [on]");
        AddMemoryOption(command, options->memory_gb,
                        "Memory for views that are read at a time [4]");
        command.add_flag("--refine", options->refine,
                         "Adjust the cameras where held-out observations of the photos gain");
        command.add_flag("--allow-missing", options->allow_missing,
                         "Leave out cameras whose photo is not there, instead of failing");
        command
            .add_option("--holdout", options->holdout, "Views kept without depth, to measure with")
            ->type_name("every:N|NAME,...");
        command.add_option("-o,--output", options->output, "The set to write, NAME.dtr")
            ->required()
            ->type_name("SET.dtr");
        command.add_flag("--force", options->force, "Replace a set that exists");
        return [options, depth_kind](const Context& context) {
          return RunImport(*options, *depth_kind, context);
        };
      });
}

}  // namespace dtr::cli
