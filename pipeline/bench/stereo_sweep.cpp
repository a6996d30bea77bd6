#include "pipeline/bench/stereo_sweep.h"

#include <fmt/format.h>

#include <algorithm>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/machine.h"
#include "dtr/io/run_record.h"
#include "dtr/io/set_io.h"
#include "dtr/types/area_average.h"
#include "pipeline/bench/detail/set_quality.h"
#include "pipeline/bench/detail/sweep_axes.h"
#include "pipeline/build/stereo.h"
#include "pipeline/core/depth/depth_stage.h"
#include "pipeline/evaluate/evaluate_depth.h"

namespace dtr::pipeline {
namespace {

enum StereoAxis : size_t { kEngine, kPreset, kMaxSize };

int LongSide(const std::filesystem::path& folder) {
  int longest = 0;
  const DtrSet set = io::ReadSet(folder);
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource) continue;
    longest = std::max({longest, view.camera.width_px(), view.camera.height_px()});
  }
  if (longest == 0) {
    throw UsageError(folder.string() + ": expected source views to find depth for, found none");
  }
  return longest;
}

/// Empty where the set's record knows of no calibration: a build without it is no whole build.
std::optional<double> OtherStages(const std::filesystem::path& set) {
  double sum_s = 0;
  bool calibrated = false;
  for (const io::RunStage& stage : io::ReadRunStages(set)) {
    if (stage.name != "depth") sum_s += stage.cpu_s;
    calibrated = calibrated || (stage.name == "calibration" && stage.cpu_s > 0);
  }
  return calibrated ? std::optional(sum_s) : std::nullopt;
}

double ErrorByTruth(const eval::DepthScores& scores, eval::SweepMeasurement& measured) {
  if (!scores.share_within_1pct) {
    throw Error("bench stereo: expected true pixels to score, found none");
  }
  constexpr double kAllRight = 1e-6;  // what stands for 0 on a logarithmic axis
  measured.figures["share_within_1pct"] = *scores.share_within_1pct;
  const auto add = [&](const char* name, const std::optional<double>& value) {
    if (value) measured.figures[name] = *value;
  };
  add("share_within_1px", scores.share_within_1px);
  add("outlier_share", scores.outlier_share);
  add("depth_completeness", scores.depth_completeness);
  return std::max(1 - *scores.share_within_1pct, kAllRight);
}

}  // namespace

void WriteResized(const std::filesystem::path& from, const std::filesystem::path& to,
                  int max_size_px, Progress& progress) {
  DtrSet set = io::ReadSet(from);
  SparseScene sparse = io::LoadSparse(from, set);
  std::vector<Eigen::Vector2d> factors;  // of pixels, per view
  // Nothing is resumed: the folder is this run's own.
  RemoveTree(to.string() + ".partial");
  io::SetWriter writer(to, fmt::format(R"({{"max_size_px":{}}})", max_size_px), true);
  io::LoadOptions load;
  load.depth = false;
  for (View& view : set.frames.front().views) {
    progress.ThrowIfInterrupted();
    io::LoadPixels(from, view, load);
    DropDepth(view);
    const int width = view.camera.width_px(), height = view.camera.height_px();
    const auto [new_width, new_height] =
        TargetSize(width, height, view.role == ViewRole::kSource ? max_size_px : 0);
    if (new_width != width || new_height != height) {
      view.image = AreaAverage(view.image, new_width, new_height);
      if (!view.mask.empty()) view.mask = ShrinkMask(view.mask, new_width, new_height);
      view.camera = view.camera.Resized(new_width, new_height);
    }
    factors.emplace_back(static_cast<double>(new_width) / width,
                         static_cast<double>(new_height) / height);
    StoreImage(view, set.unit, writer);
  }
  for (SparseObservation& seen : sparse.observations) {
    seen.pixel = seen.pixel.cwiseProduct(factors[static_cast<size_t>(seen.view)]);
  }
  writer.WriteSparse(set, sparse);
  writer.Finish(set);
}

StereoSweep::StereoSweep(StereoSweepOptions options, Progress& progress)
    : options_(std::move(options)), progress_(progress) {
  const int own = LongSide(options_.set);
  other_stages_s_ = OtherStages(options_.set);
  axes_ = {{"engine", {"patchmatch", "sgbm"}},
           {"preset", {DepthChoice{}.preset}},
           {"max-size", SizeValues(options_.max_sizes_px, own)}};
  for (const Preset& preset : Presets()) {
    if (preset.name != axes_[kPreset].values.front()) {
      axes_[kPreset].values.emplace_back(preset.name);
    }
  }
}

eval::SweepMeasurement StereoSweep::Measure(const eval::SweepSetting& setting) const {
  const auto value = [&](StereoAxis axis) {
    return axes_[axis].values.at(static_cast<size_t>(setting.at(axis)));
  };
  NotesOnly notes(progress_);
  const ScratchFolder scratch(options_.work);
  const std::filesystem::path resized = scratch / "resized.dtr", made = scratch / "stereo.dtr";
  WriteResized(options_.set, resized, std::stoi(value(kMaxSize)), notes);

  RecomputeOptions recompute;
  recompute.set = resized;
  recompute.output = made;
  recompute.depth.engine = value(kEngine);
  recompute.depth.preset = value(kPreset);
  recompute.force = true;
  recompute.seed = options_.seed;
  const double start_ms = ProcessCpuMilliseconds();
  const RecomputeReport report = RecomputeDepth(recompute, notes);
  eval::SweepMeasurement measured;
  measured.cost = (ProcessCpuMilliseconds() - start_ms) / kMillisecondsPerSecond;
  measured.cost_least = measured.cost_most = measured.cost;
  if (other_stages_s_) measured.figures["build_cpu_s"] = *other_stages_s_ + measured.cost;
  measured.figures["share_with_depth"] = report.depth_completeness;

  const DtrSet set = LoadToEvaluate(made, !options_.truth.empty(), notes);
  EvaluateImages(set, options_.render, options_.make_renderer(), measured);
  if (!options_.truth.empty()) {
    measured.error = ErrorByTruth(EvaluateDepth(set, options_.truth, notes), measured);
  }
  return measured;
}

eval::SweepStage StereoSweep::Stage() const {
  eval::SweepStage stage;
  stage.name = "stereo";
  stage.cost_name = "CPU s of the depth stage";
  stage.error_name =
      options_.truth.empty() ? "RMS error, 8-bit levels" : "share of true pixels not within 1 %";
  stage.axes = axes_;
  stage.applies = [](const eval::SweepSetting&, size_t) { return true; };
  stage.measure = [this](const eval::SweepSetting& setting) { return Measure(setting); };
  return stage;
}

}  // namespace dtr::pipeline
