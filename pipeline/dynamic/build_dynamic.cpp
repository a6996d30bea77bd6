#include "pipeline/dynamic/build_dynamic.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "calib/undistort.h"
#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/machine.h"
#include "dtr/base/quiet_progress.h"
#include "dtr/eval/json.h"
#include "dtr/io/run_record_json.h"
#include "dtr/io/set_io.h"
#include "dtr/io/still_once.h"
#include "dtr/io/validation_result.h"
#include "dtr/render/time_steps.h"
#include "pipeline/build/detail/build_json.h"
#include "pipeline/build/detail/build_options.h"
#include "pipeline/build/detail/stages.h"
#include "pipeline/core/depth/depth_engine.h"
#include "pipeline/core/photos/holdout.h"
#include "pipeline/core/photos/input_hash.h"
#include "pipeline/core/reports/set_page.h"
#include "pipeline/core/run/finishing.h"
#include "pipeline/core/run/recorded_notes.h"
#include "pipeline/core/run/run_log.h"
#include "pipeline/dynamic/detail/fixed_cameras.h"
#include "pipeline/dynamic/detail/recording.h"
#include "pipeline/dynamic/detail/step_depth.h"
#include "pipeline/dynamic/detail/still_completion.h"
#include "pipeline/validate/validate.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

void Reject(bool given, const char* what) {
  if (given) throw UsageError(std::string("`dynamic`: ") + what);
}

void RequireDynamicOptions(const BuildOptions& options, const DynamicOptions& dynamic) {
  Reject(!options.poses.empty(), "holds the cameras of `rig`, or finds them; leave out `poses`");
  Reject(options.metres.any(),
         "`gps` and `distance` do not go with it; give `rig`, whose unit holds");
  Reject(
      options.holdout_strict,
      "`holdout_strict` does not go with it; `holdout` names cameras held out at all time steps");
  Reject(options.depth.prior.given(), "depth priors are of one time step; leave out `depth_prior`");
  Reject(options.depth.time_budget_s.has_value(),
         "`time_budget` is for one time step; give `preset`");
  Reject(!options.depth.workspace.empty() || options.depth.engine == "colmap" ||
             options.depth.engine == "prior",
         "expected `engine` patchmatch, sgbm or none");
  Reject(!options.force_stage.empty(),
         "`force_stage` does not go with it; delete the partial set to begin again");
  Reject(options.video.most > 0, "takes every time step; give `every`, `from` and `to`");
  Reject(options.panoramas == capture::PanoramaUse::kAlways, "panoramas do not go with it");
  if (dynamic.video) io::RequireVideoEncoder();
  Reject(dynamic.fps && !(*dynamic.fps > 0), "`fps`: expected a positive number");
}

// Depth over time is for an engine whose planes go from one time step to the next.
bool IsTemporal(const BuildOptions& options, const DynamicOptions& dynamic,
                const stereo::QualitySettings& quality) {
  if (!dynamic.temporal || options.depth.engine == "none") return false;
  if (options.depth.engine == "patchmatch" && quality.passes > 0) return true;
  throw UsageError(
      "`temporal`: on needs `engine` patchmatch with one pass or more, whose planes go from one "
      "time step to the next; give `temporal` off");
}

Json FilesJson(const Recording& recording, const std::filesystem::path& folder) {
  Json files = Json::array();
  for (const std::filesystem::path& file : recording.Files()) {
    files.push_back({{"name", std::filesystem::relative(file, folder).generic_string()},
                     {"sha256", Sha256OfFile(file)}});
  }
  return files;
}

Json DynamicJson(const Recording& recording, const BuildOptions& options,
                 const DynamicOptions& dynamic, bool temporal) {
  Json names = Json::array();
  for (const RecordedStep& step : recording.steps()) names.push_back(step.name);
  Json json = {{"cameras", recording.cameras()},
               {"time_steps", names},
               {"every", std::max(1, options.video.every)},
               {"fps", dynamic.fps.value_or(0)},
               {"temporal", temporal}};
  json["clocks"] = dynamic.free_clocks ? "free" : "synchronised";
  if (dynamic.video) json["video"] = io::NameOf(*dynamic.video);
  return json;
}

Json ClocksJson(const Recording& recording, const std::vector<calib::MotionClock>& clocks) {
  Json json = Json::array();
  for (size_t c = 0; c < clocks.size(); ++c) {
    json.push_back({{"camera", recording.cameras()[c]},
                    {"frames_later", clocks[c].later},
                    {"frames_taken_later", std::lround(clocks[c].later)},
                    {"rms_frames", clocks[c].rms_frames},
                    {"pairs", clocks[c].pairs}});
  }
  return json;
}

// One camera after the other, so that every video is decoded once: its images on the views' grid.
void WriteImages(const Recording& recording, const FixedCameras& cameras,
                 const std::vector<bool>& held_out, const BuildOptions& options, LengthUnit unit,
                 io::SetWriter& writer, std::vector<Frame>& frames, Progress& progress) {
  const std::vector<std::string> ids = io::MakeViewIds(recording.cameras());
  const size_t steps = recording.steps().size();
  frames.resize(steps);
  for (size_t step = 0; step < steps; ++step) {
    frames[step].time_s = recording.steps()[step].time_s - recording.steps().front().time_s;
    for (size_t c = 0; c < ids.size(); ++c) {
      View view = ViewOf(cameras, recording, c, held_out, options.max_size_px);
      view.id = fmt::format("t{:04}_{}", step, ids[c]);
      frames[step].views.push_back(std::move(view));
    }
  }
  progress.Stage("images of all time steps", static_cast<int>(steps * ids.size()));
  int done = 0;
  for (size_t c = 0; c < ids.size(); ++c) {
    std::vector<bool> restored;
    for (Frame& frame : frames) restored.push_back(writer.RestoreView(frame.views[c]));
    done += static_cast<int>(std::count(restored.begin(), restored.end(), true));
    recording.ForEach(
        c, [&](size_t step) { return !restored[step]; },
        [&](size_t step, const ImageRgb8& image) {
          View& view = frames[step].views[c];
          const calib::LensCamera& lens = cameras.lens[c];
          if (image.width() != lens.width_px || image.height() != lens.height_px) {
            throw Error(fmt::format(
                "camera {}, time step {}: expected {} x {} px as its other images, found {} x {}",
                view.name, recording.steps()[step].name, lens.width_px, lens.height_px,
                image.width(), image.height()));
          }
          calib::UndistortedPhoto flat =
              calib::Undistort(image, {}, lens, lens.Pinhole(), options.max_size_px);
          view.image = std::move(flat.image);
          view.mask = std::move(flat.mask);
          writer.WriteView(view, unit);
          view.image = {};
          view.mask = {};
          progress.Update(++done);
        },
        progress);
  }
}

// What every time step gets once its depth is there.
void FinishViews(const SparseScene& points, const BuildOptions& options, double memory_gb,
                 std::optional<BackgroundViews> backgrounds, io::SetWriter& writer, DtrSet& set,
                 Progress& progress) {
  QuietProgress quiet(progress);
  std::optional<StillCompletion> still_completed;
  if (options.depth.completion && backgrounds) {
    still_completed.emplace(std::move(*backgrounds), points, set.frames.front().views, writer,
                            memory_gb, quiet);
  }
  progress.Stage("finishing time steps", static_cast<int>(set.frames.size()));
  for (size_t step = 0; step < set.frames.size(); ++step) {
    DtrSet still = TakeStep(set, step);
    if (options.depth.depth_error_px) {
      RecodeDepth(still, *options.depth.depth_error_px, writer, memory_gb, quiet);
    }
    if (options.depth.completion) {
      CompleteDepth(
          still, points, writer, memory_gb, quiet,
          still_completed ? still_completed->Of(still.frames.front().views) : KnownCompletion());
    }
    PutBack(std::move(still), step, set);
    progress.Update(static_cast<int>(step) + 1);
    progress.ThrowIfInterrupted();
  }
  io::StoreStillOnce(writer.folder(), set, memory_gb, progress);
  // After it, as a mesh names the files that it is of.
  progress.Stage("meshes", static_cast<int>(set.frames.size()));
  for (size_t step = 0; step < set.frames.size(); ++step) {
    DtrSet still = TakeStep(set, step);
    WriteMeshes(still, writer, memory_gb, quiet);
    PutBack(std::move(still), step, set);
    progress.Update(static_cast<int>(step) + 1);
    progress.ThrowIfInterrupted();
  }
}

}  // namespace

BuildReport BuildDynamicSet(const BuildOptions& asked, const DynamicOptions& dynamic,
                            Progress& listener) {
  const BuildOptions options = ByPreset(asked);
  const stereo::QualitySettings quality = QualityOf(options.depth);
  RequireDynamicOptions(options, dynamic);
  RequireEngine(options.depth);
  const bool temporal = IsTemporal(options, dynamic, quality);
  const double memory_gb = options.depth.memory_gb.value_or(kDefaultMemoryGb);
  FixedCameraOptions fixed;
  if (!options.rig.empty()) fixed.rig = ReadSetRig(options.rig);
  RequireCalibration({}, {}, options.sfm);
  io::SetWriter::RequireTarget(options.output, options.force);

  BuildReport report;
  RunLog log;
  RecordedNotes progress(listener);
  std::optional<Recording> recording;
  std::vector<bool> held_out;
  Json files;
  std::optional<io::SetWriter> writer;
  const auto capture = [&] {
    recording.emplace(options.photos,
                      StepChoice{std::max(1, options.video.every), dynamic.from, dynamic.to,
                                 dynamic.fps, dynamic.free_clocks},
                      progress);
    held_out = ChooseHeldOut(options.holdout, recording->cameras());
    if (fixed.rig) RequireRigCameras(*fixed.rig, *recording, progress);
    files = FilesJson(*recording, options.photos);
    Json fingerprint = {{"tool_version", DTR_VERSION},
                        {"options", OptionsJson(options, quality)},
                        {"dynamic", DynamicJson(*recording, options, dynamic, temporal)},
                        {"files", files}};
    if (!options.rig.empty()) fingerprint["rig_sha256"] = InputHash(options.rig);
    writer.emplace(options.output, fingerprint.dump(), options.force);
  };

  FixedCameras cameras;
  const auto calibrate = [&] {
    fixed.calibrate.held_out = held_out;
    fixed.calibrate.seed = options.seed;
    fixed.calibrate.memory_gb = memory_gb;
    fixed.calibrate.refine = options.refine;
    fixed.calibrate.sfm = options.sfm;
    fixed.max_size_px = options.max_size_px;
    fixed.free_clocks = dynamic.free_clocks;
    cameras =
        CalibrateFixedCameras(*recording, fixed, writer->work_folder() / "calibration", progress);
    log.AddEarlier(cameras.calibrated.earlier_wall_s, cameras.calibrated.earlier_cpu_s);
  };

  DtrSet set;
  const auto undistort = [&] {
    set.unit = cameras.calibrated.unit;
    set.world_origin = cameras.calibrated.world_origin;
    WriteImages(*recording, cameras, held_out, options, set.unit, *writer, set.frames, progress);
  };

  std::optional<BackgroundViews> backgrounds;
  const auto find_depth = [&] {
    backgrounds =
        ComputeStepDepths(set, cameras.all_points, {options.depth, quality, temporal, options.seed},
                          *writer, progress);
  };

  const auto finish = [&] {
    FinishViews(cameras.sparse, options, memory_gb, std::move(backgrounds), *writer, set, progress);
    if (dynamic.video) {
      io::StoreCameraVideos(writer->folder(), writer->work_folder(), set, *dynamic.video, memory_gb,
                            progress);
    }
    Json provenance =
        ProvenanceJson(options, OptionsJson(options, quality), files, cameras.calibrated, report);
    Json& json = provenance["dynamic"] = DynamicJson(*recording, options, dynamic, temporal);
    if (dynamic.free_clocks) json["found_clocks"] = ClocksJson(*recording, cameras.clocks);
    set.provenance_json = provenance.dump();
    writer->WriteSparse(set, cameras.sparse);
    DtrSet first = AtFrame(set, 0);
    SetLimits limits;
    limits.memory_gb = std::min(limits.memory_gb, memory_gb);
    const SetValidation validation =
        ValidateSet(writer->folder(), first, cameras.sparse, limits, progress);
    report.validated = true;
    report.validation_passed = validation.passed();
    set.validation_json = eval::ValidationJson(validation.tests);
    if (!report.validation_passed) progress.Note(io::ValidationWarning(set));
    WriteSetPage(*writer, first,
                 {.name = options.output.stem().string(),
                  .engine = options.depth.engine,
                  .checks = validation.tests,
                  .skipped = {},
                  .not_registered = 0,
                  .prior = {},
                  .memory_gb = memory_gb},
                 progress);
    log.End();
    io::WriteRunRecord(writer->folder(), log.Record(progress.lines()), {});
    writer->Finish(set);
  };

  RunStages({{"capture", capture},
             {"calibration", calibrate},
             {"undistortion", undistort},
             {"depth", find_depth},
             {"finishing", finish}},
            io::SetWriter::WorkFolderOf(options.output), log);
  report.set = std::move(set);
  report.written = options.output;
  report.calibration = cameras.calibrated.report;
  report.stages = log.stages();
  report.peak_memory_mib = static_cast<double>(PeakMemoryBytesWithPrograms()) / (1 << 20);
  return report;
}

}  // namespace dtr::pipeline
