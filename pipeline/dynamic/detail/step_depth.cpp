#include "pipeline/dynamic/detail/step_depth.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/quiet_progress.h"
#include "dtr/types/widen_bounds.h"
#include "pipeline/core/depth/depth_stage.h"
#include "pipeline/core/depth/plane_files.h"
#include "pipeline/core/depth/source_scene.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/core/run/finishing.h"
#include "pipeline/dynamic/detail/background_views.h"
#include "stereo/depth_range.h"
#include "stereo/pages.h"
#include "stereo/widen.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr int kWidenings = 3;         // as of still sets
constexpr double kCacheShare = 0.25;  // of the memory, for what time steps say of views

std::vector<int> SourcesOf(const std::vector<View>& views) {
  std::vector<int> sources;
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].role == ViewRole::kSource) sources.push_back(static_cast<int>(i));
  }
  return sources;
}

std::vector<View> SourceViews(const std::vector<View>& views) {
  std::vector<View> sources;
  for (const int i : SourcesOf(views)) sources.push_back(views[static_cast<size_t>(i)]);
  return sources;
}

// The first, the middle and the last time step.
std::set<size_t> SomeSteps(size_t steps) { return {0, (steps - 1) / 2, steps - 1}; }

class TemporalDepth {
 public:
  TemporalDepth(DtrSet& set, const SparseScene& points, const StepDepthOptions& options,
                io::SetWriter& writer, Progress& progress)
      : set_(set),
        sources_(SourcesOf(set.frames.front().views)),
        scene_(SourceScene(points, set.frames.front().views, sources_)),
        points_(points),
        options_(options),
        writer_(writer),
        progress_(progress) {}

  BackgroundViews Compute() {
    ranges_ = RangesOverTime();
    backgrounds_ = MakeBackgroundViews(set_, writer_, progress_);
    const std::string made_from = ComputeBackground();
    PlaneFiles background_planes(Work("background") / "planes", made_from);
    const size_t steps = set_.frames.size();
    progress_.Stage("depth over time", static_cast<int>(steps));
    double open = 0;
    for (size_t step = 0; step < steps; ++step) {
      progress_.ThrowIfInterrupted();
      open += ComputeStep(step, made_from, background_planes) / static_cast<double>(steps);
      progress_.Update(static_cast<int>(step) + 1);
    }
    RemoveTree(Work(StepName(steps - 1)));
    if (open > 0) {
      progress_.Note(fmt::format(
          "what stands still keeps one depth: {:.1f} % of the pixels were worked on per time step",
          100 * open));
    }
    return std::move(backgrounds_);
  }

 private:
  static std::string StepName(size_t step) { return fmt::format("step{:04}", step); }
  fs::path Work(const std::string& name) const { return writer_.work_folder() / name; }

  // Of the source views, from the points of several time steps and a look at some.
  std::vector<stereo::DepthRange> RangesOverTime() {
    std::vector<stereo::DepthRange> ranges;
    for (const size_t step : SomeSteps(set_.frames.size())) {
      const std::vector<View> views = SourceViews(set_.frames[step].views);
      std::vector<stereo::StereoView> stereo_views;
      stereo::DepthRangeOptions of_points;
      for (const View& view : views) {
        stereo_views.push_back({view.camera, view.cam_from_world, nullptr, nullptr});
        of_points.names.push_back(view.name);
      }
      const auto engine = stereo::MakeEngine(options_.depth.engine, options_.quality);
      stereo::NeighbourOptions neighbours;
      neighbours.count = engine->Neighbours();
      const auto chosen = stereo::ChooseNeighbours(stereo_views, scene_, neighbours);
      const auto from_points = stereo::DepthRangesFromPoints(stereo_views, scene_, of_points);
      stereo::Pages pages;
      stereo::EngineOptions engine_options;
      engine_options.seed = options_.seed;
      const auto widened =
          stereo::Widened({stereo_views, chosen, from_points, engine.get(), engine_options,
                           [&](int i) { return PixelsOf(views[static_cast<size_t>(i)]); }, &pages},
                          kWidenings, progress_);
      if (ranges.empty()) ranges = widened;
      for (size_t i = 0; i < ranges.size(); ++i) {
        ranges[i].near_z = std::min(ranges[i].near_z, widened[i].near_z);
        ranges[i].far_z = std::max(ranges[i].far_z, widened[i].far_z);
      }
    }
    return ranges;
  }

  stereo::StereoPixels PixelsOf(View view) const {
    io::LoadOptions load;
    load.depth = false;
    io::LoadPixels(writer_.folder(), view, load);
    return {std::move(view.image), std::move(view.mask)};
  }

  // Returns what its planes were computed from.
  std::string ComputeBackground() {
    DepthStageOptions stage;
    stage.seed = options_.seed;
    stage.work = Work("background");
    stage.ranges = ranges_;
    const auto result = DepthStage(backgrounds_.set, scene_, options_.depth, options_.quality,
                                   stage, writer_, progress_);
    FinishScene(backgrounds_.set, points_.points, writer_,
                options_.depth.memory_gb.value_or(kDefaultMemoryGb), progress_);
    return result.planes_made_from;
  }

  // The share of pixels that were worked on; 0 where an interrupted run had done all.
  double ComputeStep(size_t step, const std::string& made_from, PlaneFiles& background_planes) {
    std::vector<View>& views = set_.frames[step].views;
    TakeFromBackground(views);
    std::optional<PlaneFiles> before;
    if (step > 0) before.emplace(Work(StepName(step - 1)) / "planes", made_from);
    const int pass = options_.quality.passes;
    if (before && !HasAll(*before, pass)) before.reset();  // its views are all done
    const double memory_gb = options_.depth.memory_gb.value_or(kDefaultMemoryGb);
    TimeStepReader reader(backgrounds_, SourceViews(views), writer_, background_planes,
                          before ? &*before : nullptr, pass,
                          static_cast<std::uint64_t>(kCacheShare * memory_gb * kBytesPerGigabyte));
    DepthStageOptions stage;
    stage.seed = options_.seed;
    stage.work = Work(StepName(step));
    stage.ranges = ranges_;
    stage.time_steps = reader.Sources();
    stage.gains = false;
    DtrSet still = TakeStep(set_, step);
    QuietProgress quiet(progress_);
    DepthStage(still, scene_, options_.depth, options_.quality, stage, writer_, quiet);
    PutBack(std::move(still), step, set_);
    // The planes of the time step before are needed until this one is whole.
    if (step > 0) RemoveTree(Work(StepName(step - 1)));
    return reader.OpenShare();
  }

  bool HasAll(const PlaneFiles& planes, int pass) const {
    for (size_t i = 0; i < sources_.size(); ++i) {
      if (!planes.Has(pass, static_cast<int>(i))) return false;
    }
    return true;
  }

  void TakeFromBackground(std::vector<View>& views) const {
    const std::vector<View>& behind = backgrounds_.set.frames.front().views;
    for (size_t i = 0; i < sources_.size(); ++i) {
      views[static_cast<size_t>(sources_[i])].gain = behind[i].gain;
    }
  }

  DtrSet& set_;
  std::vector<int> sources_;
  SparseScene scene_;  // views are source views
  const SparseScene& points_;
  const StepDepthOptions& options_;
  io::SetWriter& writer_;
  Progress& progress_;
  std::vector<stereo::DepthRange> ranges_;
  BackgroundViews backgrounds_;
};

// Every time step by itself.
void ComputeAlone(DtrSet& set, const SparseScene& points, const StepDepthOptions& options,
                  io::SetWriter& writer, Progress& progress) {
  progress.Stage("depth, each time step alone", static_cast<int>(set.frames.size()));
  for (size_t step = 0; step < set.frames.size(); ++step) {
    progress.ThrowIfInterrupted();
    DepthStageOptions stage;
    stage.seed = options.seed;
    stage.work = writer.work_folder() / fmt::format("alone{:04}", step);
    DtrSet still = TakeStep(set, step);
    QuietProgress quiet(progress);
    DepthStage(still, points, options.depth, options.quality, stage, writer, quiet);
    PutBack(std::move(still), step, set);
    RemoveTree(stage.work);
    progress.Update(static_cast<int>(step) + 1);
  }
}

// The same centre and baselines at all time steps, those of the first; a box around all of some.
void FinishSteps(const SparseScene& points, const StepDepthOptions& options, io::SetWriter& writer,
                 DtrSet& set) {
  SilentProgress quiet;
  std::optional<DtrSet> first;
  Bounds bounds;
  for (const size_t step : SomeSteps(set.frames.size())) {
    DtrSet still = TakeStep(set, step);
    FinishScene(still, points.points, writer, options.depth.memory_gb.value_or(kDefaultMemoryGb),
                quiet);
    Widen(still.bounds, bounds);
    if (!first) first = still;
    PutBack(std::move(still), step, set);
  }
  set.scene_center = first->scene_center;
  set.bounds = bounds;
  for (Frame& frame : set.frames) {
    for (size_t i = 0; i < frame.views.size(); ++i) {
      frame.views[i].reference_baseline = first->frames.front().views[i].reference_baseline;
    }
  }
}

}  // namespace

DtrSet TakeStep(DtrSet& set, size_t step) {
  DtrSet still;
  still.unit = set.unit;
  still.world_origin = set.world_origin;
  still.scene_center = set.scene_center;
  still.bounds = set.bounds;
  still.frames.push_back(std::move(set.frames[step]));
  return still;
}

void PutBack(DtrSet&& still, size_t step, DtrSet& set) {
  set.frames[step] = std::move(still.frames.front());
}

std::optional<BackgroundViews> ComputeStepDepths(DtrSet& set, const SparseScene& points,
                                                 const StepDepthOptions& options,
                                                 io::SetWriter& writer, Progress& progress) {
  std::optional<BackgroundViews> backgrounds;
  if (options.depth.engine == "none") {
    progress.Note("depth left out: `engine` none");
  } else if (options.temporal && set.frames.size() >= kLeastTimeSteps) {
    backgrounds = TemporalDepth(set, points, options, writer, progress).Compute();
  } else {
    if (options.temporal) {
      progress.Note(fmt::format(
          "depth over time left out: {} time steps do not show what stands still; {} do",
          set.frames.size(), kLeastTimeSteps));
    }
    ComputeAlone(set, points, options, writer, progress);
  }
  FinishSteps(points, options, writer, set);
  return backgrounds;
}

}  // namespace dtr::pipeline
