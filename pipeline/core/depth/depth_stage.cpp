#include "pipeline/core/depth/depth_stage.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/memory_budget.h"
#include "dtr/io/depth_io.h"
#include "pipeline/core/depth/depth_engine.h"
#include "pipeline/core/depth/depth_precision.h"
#include "pipeline/core/depth/gains.h"
#include "pipeline/core/depth/plane_files.h"
#include "pipeline/core/depth/source_scene.h"
#include "pipeline/core/depth/time_budget.h"
#include "pipeline/core/depth_settings.h"
#include "stereo/depth_maps.h"
#include "stereo/normals.h"

namespace dtr::pipeline {
namespace {

// What the program itself takes: code, libraries, points and whatever is not counted one by one.
constexpr std::uint64_t kProgramBytes = std::uint64_t{256} << 20;
constexpr int kWidenings = 3;

// Runs `compute` within the memory chosen.
void ComputeWithin(const std::optional<double>& memory_gb, stereo::DepthMapsOptions& options,
                   Progress& progress, const std::function<void()>& compute) {
  const auto allowed =
      static_cast<std::uint64_t>(memory_gb.value_or(kDefaultMemoryGb) * kBytesPerGigabyte);
  options.memory_bytes = allowed > kProgramBytes ? allowed - kProgramBytes : 1;
  try {
    compute();
  } catch (const stereo::NotEnoughMemory& error) {
    // Rounded up, so that the number printed works when it is given.
    const double min_gb = std::ceil(1e3 * static_cast<double>(error.min_bytes() + kProgramBytes) /
                                    kBytesPerGigabyte) /
                          1e3;
    if (memory_gb) {
      throw UsageError(fmt::format(
          "`memory` {}: expected at least {:.3f} (GB) for a view with its neighbours; give as "
          "much, fewer `neighbours` or smaller images",
          *memory_gb, min_gb));
    }
    progress.Note(
        fmt::format("depth takes {:.3f} GB of memory: what a view with its neighbours "
                    "needs",
                    min_gb));
    options.memory_bytes = error.min_bytes();
    compute();
  }
}

// The source views of a set, in its order.
struct Sources {
  explicit Sources(const std::vector<View>& views) {
    for (size_t i = 0; i < views.size(); ++i) {
      if (views[i].role != ViewRole::kSource) continue;
      indices.push_back(static_cast<int>(i));
      stereo.push_back({views[i].camera, views[i].cam_from_world, nullptr, nullptr});
    }
  }
  std::vector<int> indices;
  std::vector<stereo::StereoView> stereo;
};

// The image and mask of a view as its set stores them.
stereo::StereoPixels ReadPixels(const std::filesystem::path& folder, View view) {
  io::LoadOptions load;
  load.depth = false;
  io::LoadPixels(folder, view, load);
  return {std::move(view.image), std::move(view.mask)};
}

// Of all that planes are computed from beside the settings, which the set's fingerprint holds. A
// calibration may come out otherwise when it has to be done again (COLMAP was updated, a checkpoint
// damaged): planes of the old one would fit in size and be wrong.
std::string HashOf(std::span<const stereo::StereoView> views, const SparseScene& scene) {
  std::vector<double> values;
  for (const stereo::StereoView& view : views) {
    const PinholeCamera& camera = view.camera;
    const Eigen::Vector4d turn = view.cam_from_world.rotation.coeffs();
    const Eigen::Vector3d shift = view.cam_from_world.translation;
    values.insert(values.end(),
                  {static_cast<double>(camera.width_px()), static_cast<double>(camera.height_px()),
                   camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px()});
    values.insert(values.end(), turn.data(), turn.data() + turn.size());
    values.insert(values.end(), shift.data(), shift.data() + shift.size());
  }
  for (const SparsePoint& point : scene.points) {
    values.insert(values.end(), point.p_in_world.data(), point.p_in_world.data() + 3);
  }
  for (const SparseObservation& seen : scene.observations) {
    values.insert(values.end(), {static_cast<double>(seen.view), static_cast<double>(seen.point)});
  }
  return Sha256(std::as_bytes(std::span(values)));
}

std::string NormalFileOf(const View& view) { return view.id + ".exr"; }

// Normals beside the checkpoints of this very run until all are there: what lies in the user's
// folder may be of another.
class NormalFiles {
 public:
  NormalFiles(const std::filesystem::path& work, const std::filesystem::path& folder)
      : work_(work / "normals"), folder_(folder) {}

  bool Has(const View& view) const { return folder_.empty() || exists(work_ / NormalFileOf(view)); }
  void Write(const View& view, const stereo::PlaneMap& planes,
             const stereo::DepthEstimate& estimate) const {
    std::filesystem::create_directories(work_);
    io::WriteExrOfVectors(
        work_ / NormalFileOf(view),
        stereo::NormalsOf(planes, estimate.depth, estimate.inverse_depth_sigma, view.camera));
  }
  void Deliver(const View& view) const {
    if (folder_.empty() || !exists(work_ / NormalFileOf(view))) return;
    std::filesystem::create_directories(folder_);
    CopyFileAtomically(work_ / NormalFileOf(view), folder_ / NormalFileOf(view));
  }

 private:
  std::filesystem::path work_, folder_;
};

// The range that codes of all time steps have, wider by what rounding to float can exceed it.
void StoreWithin(const stereo::DepthRange& range, View& view) {
  constexpr double kSlack = 1e-6;
  view.near_z = range.near_z * (1 - kSlack);
  view.far_z = range.far_z * (1 + kSlack);
}

void WriteDepth(View& view, stereo::DepthEstimate&& estimate, LengthUnit unit,
                io::SetWriter& writer) {
  view.depth = std::move(estimate.depth);
  view.inverse_depth_sigma = std::move(estimate.inverse_depth_sigma);
  ChooseDepthCoding(view);
  writer.WriteView(view, unit);
  view.depth = {};
  view.inverse_depth_sigma.reset();
}

}  // namespace

std::vector<std::string> NormalFileNames(const DtrSet& set) {
  std::vector<std::string> names;
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kSource) names.push_back(NormalFileOf(view));
  }
  return names;
}

namespace {

// The effort that fits into the time budget, by a probe with as many neighbours as any effort asks.
stereo::QualitySettings WithinBudget(std::span<const stereo::StereoView> views,
                                     const SparseScene& scene, const DepthChoice& choice,
                                     const stereo::DepthMapsOptions& options,
                                     const std::filesystem::path& record, Progress& progress) {
  stereo::NeighbourOptions most;
  most.count = stereo::MakeEngine("patchmatch")->Neighbours();
  const auto neighbours = stereo::ChooseNeighbours(views, scene, most);
  const auto ranges = stereo::DepthRangesFromPoints(views, scene, options.range);
  stereo::Pages pages;
  return QualityWithinBudget(
      {views, neighbours, ranges, nullptr, options.engine, options.load_pixels, &pages}, choice,
      record, progress);
}

// What depth ranges are found from.
struct RangeInputs {
  std::span<const stereo::StereoView> views;
  const SparseScene& scene;
  const stereo::Engine& engine;
  const DepthStageOptions& options;
};

// Depth ranges are found once, where `finds`: a later run, and later steps, take those of the
// first.
void KeepRanges(const RangeInputs& in, bool finds, const std::function<bool(int)>& is_done,
                PlaneFiles& planes, stereo::DepthMapsOptions& depth, Progress& progress) {
  if (!in.options.ranges.empty()) return;  // given
  const auto count = static_cast<int>(in.views.size());
  bool all_done = true;
  for (int view = 0; view < count && all_done; ++view) all_done = is_done(view);
  if (all_done) return;
  auto ranges = planes.LoadRanges(in.views.size());
  if (!ranges && !finds) {
    throw Error(
        "depth: expected depth ranges that were found, found none; run the stage ranges "
        "first");
  }
  if (!ranges) {
    ranges = stereo::WidenedRanges(in.views, in.scene, in.engine, depth, progress);
    planes.SaveRanges(*ranges);
  }
  depth.given_ranges = std::move(*ranges);
  depth.widenings = 0;
}

// Processes that share the work have folders of their own for what they throw away.
std::string EstimatesOf(const std::optional<DepthStep>& step) {
  if (!step) return "estimates";
  return fmt::format("estimates_{}_{}_of_{}", step->pass, step->part.index, step->part.count);
}

}  // namespace

void StoreImage(View& view, LengthUnit unit, io::SetWriter& writer) {
  if (!writer.RestoreView(view)) writer.WriteView(view, unit);
  view.image = {};
  view.mask = {};
}

DepthStageResult DepthStage(DtrSet& set, const SparseScene& sparse, const DepthChoice& choice,
                            const stereo::QualitySettings& asked, const DepthStageOptions& options,
                            io::SetWriter& writer, Progress& progress,
                            const std::optional<DepthStep>& step) {
  if (choice.engine == "none") {
    progress.Note("depth left out: `engine` none");
    return {asked, std::nullopt, {}};
  }
  const std::filesystem::path work = options.work.empty() ? writer.work_folder() : options.work;
  std::vector<View>& views = set.frames.front().views;
  Sources sources(views);
  const SparseScene scene = SourceScene(sparse, views, sources.indices);
  const auto view_of = [&](int source) -> View& {
    return views[static_cast<size_t>(sources.indices[static_cast<size_t>(source)])];
  };

  stereo::DepthMapsOptions depth_options;
  depth_options.widenings = options.ranges.empty() ? kWidenings : 0;
  depth_options.given_ranges = options.ranges;
  for (const int index : sources.indices) {
    depth_options.range.names.push_back(views[static_cast<size_t>(index)].name);
  }
  for (size_t i = 0; i < options.time_steps.size(); ++i) {
    sources.stereo[i].time_step = &options.time_steps[i];
  }
  std::optional<DepthPriors> priors;
  if (choice.prior.given()) {
    std::vector<const View*> source_views;
    for (const int index : sources.indices) {
      source_views.push_back(&views[static_cast<size_t>(index)]);
    }
    try {
      priors.emplace(choice.prior, source_views, sources.stereo, scene, set.unit, options.photos,
                     progress);
    } catch (const Interrupted&) {
      throw;
    } catch (const Error&) {
      // The command that is corrected must not find this one's work in its way.
      options.keep_work ? options.keep_work() : writer.Discard();
      throw;
    }
    priors->Attach(sources.stereo);
    depth_options.given_ranges =
        priors->Widened(stereo::DepthRangesFromPoints(sources.stereo, scene, depth_options.range));
    if (choice.engine == "prior") depth_options.consistency.min_agreeing = 0;
  }
  depth_options.engine.seed = options.seed;
  depth_options.load_pixels = [&](int source) {
    return ReadPixels(writer.folder(), view_of(source));
  };
  const stereo::QualitySettings quality =
      choice.time_budget_s ? WithinBudget(sources.stereo, scene, choice, depth_options,
                                          work / "effort.json", progress)
                           : asked;
  if (!options.normals.empty() && (choice.engine != "patchmatch" || quality.passes == 0)) {
    throw UsageError(
        "`normals`: expected `engine` patchmatch with one pass or more, whose planes they are of");
  }
  const auto engine = MakeDepthEngine(
      choice, quality,
      {views, sources.indices, sources.stereo, &scene, set.world_origin, writer.folder(), work},
      progress);
  depth_options.neighbours.count = engine->Neighbours();
  // The other half holds photos, and maps that wait for their neighbours to be done.
  depth_options.engine.memory_gb = choice.memory_gb.value_or(kDefaultMemoryGb) / 2;
  const std::string made_from = HashOf(sources.stereo, scene);
  const bool finds_ranges = !step || step->pass == DepthStep::kRanges;
  PlaneFiles planes(work / "planes", made_from, !finds_ranges);
  const NormalFiles normals(work, options.normals);
  const auto is_done = [&](int source) {
    const View& view = view_of(source);
    return view.depth_file.has_value() && normals.Has(view);
  };
  const auto is_done_or_others = [&](int source) {
    const auto item = static_cast<size_t>(source);
    return (step && !step->part.Has(item, sources.stereo.size())) || is_done(source);
  };
  EstimateFiles estimates(work / EstimatesOf(step));
  depth_options.has_passes = step.has_value();
  depth_options.planes = &planes;
  depth_options.estimates = &estimates;
  ComputeWithin(choice.memory_gb, depth_options, progress, [&] {
    KeepRanges({sources.stereo, scene, *engine, options}, finds_ranges, is_done, planes,
               depth_options, progress);
    if (step && finds_ranges) return;
    if (step && step->pass <= engine->Passes()) {
      return stereo::ComputeDepthPass(sources.stereo, scene, *engine, depth_options, step->pass,
                                      progress, is_done_or_others);
    }
    stereo::ComputeDepthMaps(
        sources.stereo, scene, *engine, depth_options, progress, is_done_or_others,
        [&](int source, stereo::DepthEstimate&& estimate, const stereo::DepthRange& range) {
          View& view = view_of(source);
          if (!options.ranges.empty()) StoreWithin(range, view);
          if (!options.normals.empty()) {
            normals.Write(view, *planes.Load(engine->Passes(), source), estimate);
          }
          WriteDepth(view, std::move(estimate), set.unit, writer);
        });
  });
  if (step) return {quality, std::nullopt, made_from};
  if (options.gains) {
    const double memory_gb = choice.memory_gb.value_or(kDefaultMemoryGb);
    SetGains(set, scene, writer.folder(), memory_gb, progress);
  }
  for (const int index : sources.indices) normals.Deliver(views[static_cast<size_t>(index)]);
  if (const std::string codings = SayDepthCodings(views); !codings.empty()) progress.Note(codings);
  DepthStageResult result{quality, std::nullopt, made_from};
  if (priors) result.prior = priors->report();
  return result;
}

}  // namespace dtr::pipeline
