#include "cli/build_arguments.h"

#include <fmt/format.h>

#include <cstdio>

#include "cli/depth_options.h"
#include "cli/panorama_options.h"
#include "cli/sfm_options.h"
#include "cli/video_options.h"
#include "dtr/base/error.h"
#include "pipeline/core/camera_file.h"

namespace dtr::cli {
namespace {

// What concerns sets of several time steps alone.
void AddDynamicOptions(CLI::App& command, BuildArguments& arguments) {
  CLI::Option* dynamic =
      command.add_flag("--dynamic", arguments.is_dynamic,
                       "A dynamic set: PHOTOS has a video or folder of photos per fixed camera; "
                       "frames of equal number are time steps");
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
  command
      .add_option("--clocks", arguments.clocks,
                  "With --dynamic: synchronised: frames of equal number are of one time; free: "
                  "cameras began when they liked, and how many frames later each one's are is "
                  "found from what moves [synchronised]")
      ->check(CLI::IsMember({"synchronised", "free"}))
      ->needs(dynamic);
  command
      .add_option("--video", arguments.video,
                  "With --dynamic: store the images of source cameras as H.264 videos of this rate "
                  "factor, 1 (largest) to 51, or lossless [every image a PNG]")
      ->needs(dynamic)
      ->type_name("CRF");
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

}  // namespace

void AddBuildOptions(CLI::App& command, BuildArguments& arguments) {
  pipeline::BuildOptions* options = &arguments.options;
  command.add_option("PHOTOS", options->photos, "Folder of photos, a video, or a folder of videos")
      ->required();
  command.add_option("-o,--output", options->output, "The set to write, NAME.dtr")
      ->required()
      ->type_name("SET.dtr");
  if constexpr (DTR_WITH_DYNAMIC) AddDynamicOptions(command, arguments);
  AddVideoOptions(command, options->video);
  AddPanoramaOption(command, options->panoramas);
  command
      .add_option("--holdout", options->holdout,
                  "Photos held out from depth and textures, to measure with")
      ->type_name("every:N|NAME,...");
  command.add_flag("--holdout-strict", options->holdout_strict,
                   "Photos of --holdout take no part in SfM and are registered afterwards");
  AddDepthOptions(command, {"sgbm", "patchmatch", "colmap", "prior", "none"},
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
                  "Known cameras, a file or folder of any program that --format names")
      ->type_name("FILE");
  command.add_option("--format", options->poses_format, "Format of --poses [by its content]")
      ->check(CLI::IsMember(pipeline::CameraFormats()))
      ->needs("--poses");
  command
      .add_option("--rig", options->rig,
                  "Calibration of the rig that took all photos, of `dtr calibrate rig`")
      ->type_name("RIG.json");
  CLI::Option* no_refine =
      command.add_flag("!--no-refine", options->refine,
                       "Take COLMAP's cameras as they are, without bundle adjustment");
  command
      .add_flag("--refine", options->refine_poses,
                "Adjust the cameras of --poses, where held-out observations gain")
      ->excludes(no_refine);
  AddSfmOptions(command, options->sfm);
  AddMetreOptions(command, *AddGpsFlag(command, options->metres.gps), arguments.metre_words);
  command.add_flag("--keep-duplicates", options->keep_duplicates,
                   "Keep photos whose pixels are another's, too (with --poses and --rig they "
                   "always are)");
  command.add_flag("--force", options->force, "Replace a set that exists");
  command
      .add_option("--force-stage", options->force_stage,
                  "Of an interrupted build: do this stage and all after it again")
      ->check(CLI::IsMember(pipeline::StagesKept()))
      ->type_name("NAME");
  AddPartOptions(command, arguments);
}

void FinishBuildArguments(const CommonOptions& common, BuildArguments& arguments) {
  pipeline::BuildOptions& options = arguments.options;
  options.metres = MetreOptionsFrom(options.metres.gps, arguments.metre_words);
  options.seed = common.seed;
  arguments.dynamic.temporal = arguments.temporal == "on";
  arguments.dynamic.free_clocks = arguments.clocks == "free";
  if (!arguments.video.empty()) arguments.dynamic.video = io::VideoQualityFrom(arguments.video);
}

std::optional<pipeline::BuildPart> PartOf(const BuildArguments& arguments) {
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

}  // namespace dtr::cli
