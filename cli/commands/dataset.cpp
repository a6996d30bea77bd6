#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "capture/contents_json.h"
#include "capture/ingest.h"
#include "cli/command.h"
#include "datasets/convert/convert.h"
#include "datasets/list.h"
#include "datasets/make.h"
#include "dtr/base/error.h"

namespace dtr::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

void AddList(CLI::App& dataset) {
  AddCommand(
      dataset, "list", "Name the scenes that can be made and the public sets that are known",
      "dtr dataset list", [](CLI::App&) -> Action {
        return [](const Context& context) -> int {
          Json json = Json::array();
          for (const auto& info : datasets::ListDatasets()) {
            context.console.Say(fmt::format("{:<26} {:<7} {}", info.name,
                                            info.is_made_here ? "made" : "public", info.summary));
            json.push_back({{"name", info.name},
                            {"made_here", info.is_made_here},
                            {"summary", info.summary},
                            {"layouts", info.layouts},
                            {"origin", info.origin},
                            {"licence", info.licence}});
          }
          context.EmitJson(Json{{"datasets", json}}.dump(1));
          return kDone;
        };
      });
}

struct MakeOptions {
  datasets::DatasetSpec spec;
  std::optional<int> views, width_px, height_px, steps;  // the scene has its own defaults
  fs::path output;
  std::vector<double> offset;
};

void DeclareMakeOptions(CLI::App& command, MakeOptions& options) {
  datasets::DatasetSpec& spec = options.spec;
  command
      .add_option("NAME", spec.scene,
                  "Scene: courtyard, plane, stairs, sphere, room, plain-room or toys")
      ->required();
  command.add_option("-o,--output", options.output, "Folder to write")
      ->required()
      ->type_name("DIR");
  command.add_option("--layout", spec.layout, "Cameras: arc, grid, ring, line or inside-out");
  command.add_option("--views", options.views, "Number of cameras [16; toys 8]")->type_name("N");
  command.add_option("--width", options.width_px, "Photo width [960; toys 320]")->type_name("PX");
  command.add_option("--height", options.height_px, "Photo height [640; toys 216]")
      ->type_name("PX");
  command.add_option("--focal", spec.focal_35mm, "Focal length of a frame 36 mm wide, mm [28]")
      ->type_name("MM");
  command
      .add_option("--steps", options.steps,
                  "Time steps, of scenes that move: photos of every camera, rig.json and truth "
                  "for each [1; toys 30]")
      ->type_name("N");
  command.add_option("--fps", spec.steps_per_second, "Time steps per second [10]")->type_name("N");
  command.add_flag("--videos", spec.videos,
                   "Of several time steps: a lossless video of every camera instead of photos");
  command.add_flag("--panoramas", spec.panoramas,
                   "360 degree panoramas of that width, half as high, with the views of a cube "
                   "around each");
  command.add_option("--noise", spec.noise, "Standard deviation of pixel noise, 8-bit levels [0]");
  command
      .add_option(
          "--supersampling", spec.supersampling,
          "N x N rays per pixel of a photo: 1 takes a ninth of the time, with stairs at edges "
          "[3]")
      ->type_name("N");
  command.add_option("--exposure-drift", spec.exposure_drift,
                     "Stops from the first photo to the last [0]");
  command.add_option("--k1", spec.k1, "Radial lens distortion of the photos [0]");
  command.add_option("--k2", spec.k2, "Second radial coefficient [0]");
  command.add_flag("--fisheye", spec.fisheye,
                   "Photos of a fisheye: equidistant, --k1 and --k2 are of the angle; --focal 11.5 "
                   "sees 180 degrees");
  command.add_option("--world-offset", options.offset, "Where the written world has its origin")
      ->expected(3)
      ->type_name("X Y Z");
  command
      .add_option("--time", spec.time_s, "Time in seconds, for dynamic scenes: sphere, toys [0]")
      ->type_name("S");
  command.add_option("--scale", spec.scale, "Size of the written world [1]");
}

void AddMake(CLI::App& dataset) {
  AddCommand(
      dataset, "make", "Make an exact synthetic photo collection with truth",
      "dtr dataset make courtyard -o courtyard/ --views 16", [](CLI::App& command) -> Action {
        auto options = std::make_shared<MakeOptions>();
        DeclareMakeOptions(command, *options);
        return [options](const Context& context) -> int {
          datasets::DatasetSpec spec = options->spec;
          const datasets::DatasetSpec own = datasets::DefaultSpecOf(spec.scene);
          spec.views = options->views.value_or(own.views);
          spec.width_px = options->width_px.value_or(own.width_px);
          spec.height_px = options->height_px.value_or(own.height_px);
          spec.steps = options->steps.value_or(own.steps);
          // --seed 0, the default of every command, keeps the scene's own seed.
          if (context.common.seed != 0) spec.seed = context.common.seed;
          if (!options->offset.empty()) {
            spec.world_offset = {options->offset[0], options->offset[1], options->offset[2]};
          }
          datasets::MakeDataset(spec, options->output, context.console);
          context.console.Say(spec.steps == 1
                                  ? fmt::format("{}: {} photos of {}", options->output.string(),
                                                spec.views, spec.scene)
                                  : fmt::format("{}: {} cameras, {} time steps of {}",
                                                options->output.string(), spec.views, spec.steps,
                                                spec.scene));
          context.EmitJson(datasets::FormatSpecJson(spec));
          return kDone;
        };
      });
}

void AddGet(CLI::App& dataset) {
  struct Options {
    std::string name;
    fs::path folder;
  };
  AddCommand(
      dataset, "get", "Check a copy of a public set against the known checksums",
      "dtr dataset get llff_fern --folder data/llff_fern", [](CLI::App& command) -> Action {
        auto options = std::make_shared<Options>();
        command.add_option("NAME", options->name, "Name, as dtr dataset list gives it")->required();
        command.add_option("--folder", options->folder, "Where the copy lies")
            ->required()
            ->type_name("DIR");
        return [options](const Context& context) -> int {
          const auto check = datasets::CheckPublicSet(options->name, options->folder);
          context.console.Say(fmt::format("{}: {} files as known, {} missing, {} changed",
                                          check.name, check.files_ok, check.missing.size(),
                                          check.changed.size()));
          for (const auto& file : check.missing) context.console.Say("  missing: " + file);
          for (const auto& file : check.changed) context.console.Say("  changed: " + file);
          context.EmitJson(Json{
              {"files_ok", check.files_ok}, {"missing", check.missing}, {"changed", check.changed}}
                               .dump(1));
          return check.Ok() ? kDone : kFailed;
        };
      });
}

void AddConvert(CLI::App& dataset) {
  struct Options {
    std::string kind;
    fs::path source, output;
  };
  AddCommand(dataset, "convert", "Bring a public set with known cameras into this toolkit's layout",
             "dtr dataset convert fountain data/strecha_fountain_p11 -o fountain/",
             [](CLI::App& command) -> Action {
               auto options = std::make_shared<Options>();
               command.add_option("KIND", options->kind, "Which set it is")
                   ->required()
                   ->check(CLI::IsMember(datasets::ConvertibleKinds()));
               command.add_option("SRC", options->source, "Folder of the set")->required();
               command.add_option("-o,--output", options->output, "Folder to write")
                   ->required()
                   ->type_name("DIR");
               return [options](const Context& context) -> int {
                 capture::FolderContents contents;
                 if (std::filesystem::is_directory(options->source)) {
                   contents = capture::ContentsOf(options->source, true);
                   context.console.Note(capture::LineOf(contents));
                 }
                 datasets::ConvertDataset(options->kind, options->source, options->output);
                 context.console.Say(fmt::format(
                     "{}: cameras.json and images/ (and depth/, masks/ where the set has them)",
                     options->output.string()));
                 context.EmitJson(Json{{"folder", options->output.string()},
                                       {"contents", capture::JsonOf(contents)}});
                 return kDone;
               };
             });
}

}  // namespace

void AddDatasetCommand(CLI::App& app) {
  CLI::App* dataset = app.add_subcommand("dataset", "Synthetic scenes and public data sets");
  dataset->require_subcommand(1);
  AddList(*dataset);
  AddMake(*dataset);
  AddGet(*dataset);
  AddConvert(*dataset);
}

}  // namespace dtr::cli
