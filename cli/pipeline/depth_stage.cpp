#include "cli/pipeline/depth_stage.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <optional>

#include "cli/pipeline/depth_engine.h"
#include "cli/pipeline/depth_precision.h"
#include "cli/pipeline/plane_files.h"
#include "cli/pipeline/time_budget.h"
#include "dtr/base/error.h"
#include "dtr/io/depth_io.h"
#include "stereo/depth_maps.h"
#include "stereo/normals.h"

namespace dtr::pipeline {
namespace {

// The scene as the source views alone know it, with views renumbered to their order among sources.
SparseScene SourceScene(const SparseScene& sparse, const std::vector<View>& views,
                        const std::vector<int>& sources) {
  std::vector<bool> is_source(views.size(), false);
  std::vector<int> source_index(views.size(), -1);
  for (size_t s = 0; s < sources.size(); ++s) {
    is_source[static_cast<size_t>(sources[s])] = true;
    source_index[static_cast<size_t>(sources[s])] = static_cast<int>(s);
  }
  SparseScene scene = RestrictToViews(sparse, is_source);
  for (SparseObservation& seen : scene.observations) {
    seen.view = source_index[static_cast<size_t>(seen.view)];
  }
  return scene;
}

// What the program itself takes: code, libraries, points and whatever is not counted one by one.
constexpr std::uint64_t kProgramBytes = std::uint64_t{256} << 20;
constexpr double kBytesPerGb = 1e9;
constexpr int kWidenings = 3;

// Runs `compute` within the memory chosen.
void ComputeWithin(const std::optional<double>& memory_gb, stereo::DepthMapsOptions& options,
                   Progress& progress, const std::function<void()>& compute) {
  const auto allowed =
      static_cast<std::uint64_t>(memory_gb.value_or(kDefaultMemoryGb) * kBytesPerGb);
  options.memory_bytes = allowed > kProgramBytes ? allowed - kProgramBytes : 1;
  try {
    compute();
  } catch (const stereo::NotEnoughMemory& error) {
    // Rounded up, so that the number printed works when it is given.
    const double least_gb =
        std::ceil(1e3 * static_cast<double>(error.least_bytes() + kProgramBytes) / kBytesPerGb) /
        1e3;
    if (memory_gb) {
      throw UsageError(fmt::format(
          "--memory {}: expected at least {:.3f} (GB) for a view with its neighbours; give as "
          "much, fewer --neighbours or smaller images",
          *memory_gb, least_gb));
    }
    progress.Note(
        fmt::format("depth takes {:.3f} GB of memory: what a view with its neighbours "
                    "needs",
                    least_gb));
    options.memory_bytes = error.least_bytes();
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
stereo::StereoPixels ReadPixels(const std::filesystem::path& folder, View view, int threads) {
  io::LoadOptions load;
  load.depth = false;
  load.threads = threads;
  io::LoadPixels(folder, view, load);
  return {std::move(view.image), std::move(view.mask)};
}

// Where the normals of a view go.
std::filesystem::path NormalsFile(const std::filesystem::path& folder, const View& view) {
  return folder / std::filesystem::path(view.name).replace_extension(".exr");
}

void WriteNormals(const std::filesystem::path& file, const stereo::PlaneMap& planes,
                  const DepthImage& depth, const PinholeCamera& camera) {
  std::filesystem::create_directories(file.parent_path());
  io::WriteExrOfVectors(file, stereo::NormalsOf(planes, depth, camera));
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

// The effort that fits into the time budget, by a probe with as many neighbours as any effort asks.
stereo::Effort WithinBudget(std::span<const stereo::StereoView> views, const SparseScene& scene,
                            const DepthChoice& choice, const stereo::DepthMapsOptions& options,
                            const std::filesystem::path& record, Progress& progress) {
  stereo::NeighbourOptions most;
  most.count = stereo::MakeEngine("patchmatch")->Neighbours();
  const auto neighbours = stereo::ChooseNeighbours(views, scene, most);
  const auto ranges = stereo::DepthRangesFromPoints(views, scene, options.range);
  stereo::Pages pages;
  return EffortWithinBudget(
      {views, neighbours, ranges, nullptr, options.engine, options.load_pixels, &pages}, choice,
      record, progress);
}

}  // namespace

void StoreImage(View& view, LengthUnit unit, io::SetWriter& writer) {
  if (!writer.RestoreView(view)) writer.WriteView(view, unit);
  view.image = {};
  view.mask = {};
}

stereo::Effort DepthStage(DtrSet& set, const SparseScene& sparse, const DepthChoice& choice,
                          const stereo::Effort& asked, const DepthStageOptions& options,
                          io::SetWriter& writer, Progress& progress) {
  if (choice.engine == "none") {
    progress.Note("depth left out: --engine none");
    return asked;
  }
  std::vector<View>& views = set.frames.front().views;
  const Sources sources(views);
  const SparseScene scene = SourceScene(sparse, views, sources.indices);
  const auto view_of = [&](int source) -> View& {
    return views[static_cast<size_t>(sources.indices[static_cast<size_t>(source)])];
  };

  stereo::DepthMapsOptions depth_options;
  depth_options.widenings = kWidenings;
  depth_options.engine.threads = options.threads;
  depth_options.engine.seed = options.seed;
  depth_options.load_pixels = [&](int source) {
    return ReadPixels(writer.folder(), view_of(source), options.threads);
  };
  const stereo::Effort effort = choice.time_budget_s
                                    ? WithinBudget(sources.stereo, scene, choice, depth_options,
                                                   writer.work_folder() / "effort.json", progress)
                                    : asked;
  if (!options.normals.empty() && (choice.engine != "patchmatch" || effort.rounds == 0)) {
    throw UsageError(
        "--normals: expected --engine patchmatch with one round or more, whose planes they are of");
  }
  const auto engine = MakeDepthEngine(choice, effort,
                                      {views, sources.indices, sources.stereo, &scene,
                                       set.world_origin, writer.folder(), writer.work_folder()},
                                      progress);
  depth_options.neighbours.count = engine->Neighbours();
  // The other half holds photos, and maps that wait for their neighbours to be done.
  depth_options.engine.memory_gb = choice.memory_gb.value_or(kDefaultMemoryGb) / 2;
  PlaneFiles planes(writer.work_folder() / "planes");
  EstimateFiles estimates(writer.work_folder() / "estimates");
  depth_options.planes = &planes;
  depth_options.estimates = &estimates;
  ComputeWithin(choice.memory_gb, depth_options, progress, [&] {
    stereo::ComputeDepthMaps(
        sources.stereo, scene, *engine, depth_options, progress,
        [&](int source) {
          const View& view = view_of(source);
          return view.depth_file.has_value() &&
                 (options.normals.empty() ||
                  std::filesystem::exists(NormalsFile(options.normals, view)));
        },
        [&](int source, stereo::DepthEstimate&& estimate, const stereo::DepthRange&) {
          View& view = view_of(source);
          if (!options.normals.empty()) {
            WriteNormals(NormalsFile(options.normals, view), *planes.Load(engine->Rounds(), source),
                         estimate.depth, view.camera);
          }
          WriteDepth(view, std::move(estimate), set.unit, writer);
        });
  });
  if (const std::string codings = SayDepthCodings(views); !codings.empty()) progress.Note(codings);
  return effort;
}

}  // namespace dtr::pipeline
