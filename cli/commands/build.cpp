#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "cli/command.h"
#include "cli/depth_options.h"
#include "cli/metre_options.h"
#include "cli/not_registered.h"
#include "cli/panorama_options.h"
#include "cli/sfm_options.h"
#include "cli/video_options.h"
#include "dtr/base/error.h"
#include "pipeline/build.h"
#include "pipeline/build_dynamic.h"
#include "pipeline/import.h"

namespace dtr::cli {
namespace {

struct BuildArguments {
  pipeline::BuildOptions options;
  bool is_dynamic = false;
  std::string temporal = "on";
  std::string stage, part = "1/1";
  pipeline::DynamicOptions dynamic;
};

// What concerns sets of several time steps alone.
void AddDynamicOptions(CLI::App& command, BuildArguments& arguments) {
  CLI::Option* dynamic =
      command.add_flag("--dynamic", arguments.is_dynamic,
                       "A dynamic set: a video or folder of photos of each of several fixed "
                       "cameras, whose frames of "
                       "equal number (or sync_index of timestamps.csv) are time steps");
  command
      .add_option("--from", arguments.dynamic.from, "With --dynamic: first time step, from 0 [0]")
      ->check(CLI::NonNegativeNumber)
      ->needs(dynamic)
      ->type_name("N");
  command.add_option("--to", arguments.dynamic.to, "With --dynamic: last time step [all]")
      ->check(CLI::NonNegativeNumber)
      ->needs(dynamic)
      ->type_name("N");
  command
      .add_option("--fps", arguments.dynamic.fps,
                  "With --dynamic: time steps per second [as the videos; photos 24]")
      ->needs(dynamic)
      ->type_name("N");
  command
      .add_option("--temporal", arguments.temporal,
                  "With --dynamic: on: depth begins with that of the time step before, and what "
                  "stands still keeps one depth; off: every time step alone [on]")
      ->check(CLI::IsMember({"on", "off"}))
      ->needs(dynamic);
}

// What processes that share a build are given.
void AddPartOptions(CLI::App& command, BuildArguments& arguments) {
  CLI::Option* stage = command.add_option(
      "--stage", arguments.stage,
      "Do this stage alone and keep its work beside the set, for processes that share a build "
      "(dtr batch): capture, features, pairs, matching, verification, calibration, undistortion, "
      "ranges, search, pass-N, maps; the same command without it ends the build");
  stage->type_name("NAME");
  command
      .add_option("--part", arguments.part,
                  "With --stage: part K of N of its photos, pairs or views [1/1]")
      ->needs(stage)
      ->type_name("K/N");
}

std::optional<pipeline::BuildPart> PartFrom(const BuildArguments& arguments) {
  if (arguments.stage.empty()) return {};
  if (arguments.is_dynamic) {
    throw UsageError("`dynamic`: its time steps follow each other; leave out `stage`");
  }
  int index = 0, count = 0, used = 0;
  const std::string& text = arguments.part;
  if (std::sscanf(text.c_str(), "%d/%d%n", &index, &count, &used) != 2 ||
      static_cast<size_t>(used) != text.size() || count < 1 || index < 1 || index > count) {
    throw UsageError(fmt::format("`part` {}: expected K/N with K from 1 to N", text));
  }
  return pipeline::BuildPart{arguments.stage, {index - 1, count}};
}

void SayResult(const pipeline::BuildOptions& options, const pipeline::BuildReport& report,
               Console& console) {
  if (report.part) {
    console.Say(fmt::format("{}: done: {}", options.output.string(), NameOf(*report.part)));
    return;
  }
  if (report.set.frames.size() > 1) {
    console.Say(
        fmt::format("{}: {} time steps of:", options.output.string(), report.set.frames.size()));
  }
  const auto& views = report.set.frames.front().views;
  const auto held_out = std::count_if(
      views.begin(), views.end(), [](const View& view) { return view.role == ViewRole::kHeldOut; });
  console.Say(fmt::format("{}: {} views to render from, {} held out", options.output.string(),
                          static_cast<long>(views.size()) - held_out, held_out));
  SayNotRegistered(report.not_registered, report.why_not_registered, console);
  for (const auto& [name, reason] : report.skipped) {
    console.Say(fmt::format("  skipped: {}: {}", name, reason));
  }
  if (report.validated) {
    console.Say(report.validation_passed
                    ? "  calibration: reprojection tests passed"
                    : "  calibration: REPROJECTION TESTS FAILED; dtr validate says which");
  }
  for (const std::string& line : report.coverage) console.Say("  " + line);
  if (!report.coverage.empty()) {
    console.Say(fmt::format("  dtr advise {} says where", options.output.string()));
  }
}

}  // namespace

void AddBuildCommand(CLI::App& app) {
  AddCommand(
      app, "build", "Build a D+TR set from photos or videos",
      "dtr build photos/ -o scene.dtr --holdout every:8", [](CLI::App& command) -> Action {
        auto arguments = std::make_shared<BuildArguments>();
        pipeline::BuildOptions* options = &arguments->options;
        AddDynamicOptions(command, *arguments);
        command
            .add_option("PHOTOS", options->photos,
                        "Folder of photos, a video, or a folder of videos")
            ->required();
        command.add_option("-o,--output", options->output, "The set to write, NAME.dtr")
            ->required()
            ->type_name("SET.dtr");
        AddVideoOptions(command, options->video);
        AddPanoramaOption(command, options->panoramas);
        command
            .add_option("--holdout", options->holdout,
                        "Photos held out from depth and textures, to measure with")
            ->type_name("every:N|NAME,...");
        command.add_flag("--holdout-strict", options->holdout_strict,
                         "Keep them out of SfM too and register them afterwards");
        AddDepthOptions(
            command, {"sgbm", "patchmatch", "colmap", "prior", "none"},
            "Long side 800, 1024 or full size, and work spent on depth and, with fast, on "
            "cameras (--features 4096) [balanced]",
            options->depth);
        command
            .add_option("--max-size", options->max_size_px,
                        "Long side of the set's images; 0 = full size; overrides the preset")
            ->check(CLI::Range(0, 65536))
            ->type_name("PX");
        command
            .add_option("--poses", options->poses,
                        "Known cameras, a file or folder of any program that --format names; no "
                        "SfM then")
            ->type_name("FILE");
        command.add_option("--format", options->poses_format, "Format of --poses [by its content]")
            ->check(CLI::IsMember(pipeline::CameraFormats()))
            ->needs("--poses");
        command
            .add_option("--rig", options->rig,
                        "Calibration of the rig that took all photos, of `dtr calibrate rig`: its "
                        "intrinsics, positions and scale are fixed")
            ->type_name("RIG.json");
        CLI::Option* no_refine =
            command.add_flag("!--no-refine", options->refine,
                             "Take COLMAP's cameras as they are, without bundle adjustment");
        command
            .add_flag("--refine", options->refine_poses,
                      "Adjust the cameras of --poses, where held-out observations gain")
            ->excludes(no_refine);
        AddSfmOptions(command, options->sfm);
        auto words = std::make_shared<MetreWords>();
        AddMetreOptions(command, *AddGpsFlag(command, options->metres.gps), *words);
        command.add_flag("--keep-duplicates", options->keep_duplicates,
                         "Keep photos whose pixels are another's, too (with --poses and --rig they "
                         "always are)");
        command.add_flag("--force", options->force, "Replace a set that exists");
        command
            .add_option("--force-stage", options->force_stage,
                        "Of an interrupted build: do this stage and all after it again")
            ->check(CLI::IsMember(pipeline::StagesKept()))
            ->type_name("NAME");
        AddPartOptions(command, *arguments);
        return [arguments, options, words](const Context& context) -> int {
          context.console.KeepsWork();
          options->metres = MetreOptionsFrom(options->metres.gps, *words);
          options->threads = context.common.threads;
          options->seed = context.common.seed;
          options->part = PartFrom(*arguments);
          arguments->dynamic.temporal = arguments->temporal == "on";
          const auto report =
              arguments->is_dynamic
                  ? pipeline::BuildDynamicSet(*options, arguments->dynamic, context.console)
                  : pipeline::BuildSet(*options, context.console);
          SayResult(*options, report, context.console);
          if (!report.part) context.EmitJson(pipeline::ToJson(report));
          return kDone;
        };
      });
}

}  // namespace dtr::cli
