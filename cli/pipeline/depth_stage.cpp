#include "cli/pipeline/depth_stage.h"

#include "cli/pipeline/depth_engine.h"
#include "cli/pipeline/plane_files.h"
#include "stereo/depth_maps.h"

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

}  // namespace

void DepthStage(DtrSet& set, const SparseScene& sparse, const DepthChoice& choice,
                const stereo::Effort& effort, const DepthStageOptions& options,
                io::SetWriter& writer, Progress& progress) {
  std::vector<View>& views = set.frames.front().views;
  std::vector<int> sources;
  std::vector<stereo::StereoView> stereo_views;
  for (size_t i = 0; i < views.size(); ++i) {
    View& view = views[i];
    // Images first: what an interrupted run wrote is recognised and not written again.
    if (!writer.RestoreView(view)) writer.WriteView(view, set.unit);
    if (view.role != ViewRole::kSource) continue;
    sources.push_back(static_cast<int>(i));
    stereo_views.push_back({view.camera, view.cam_from_world, &view.image, &view.mask});
  }
  if (choice.engine == "none") {
    progress.Note("depth left out: --engine none");
    return;
  }

  const SparseScene scene = SourceScene(sparse, views, sources);
  const auto engine = MakeDepthEngine(choice, effort,
                                      {views, sources, stereo_views, &scene, set.world_origin,
                                       writer.folder(), writer.work_folder()},
                                      progress);

  stereo::DepthMapsOptions depth_options;
  depth_options.neighbours.count = engine->Neighbours();
  depth_options.engine.threads = options.threads;
  depth_options.engine.seed = options.seed;
  // The other half holds the photos, and maps that wait for their neighbours to be done.
  depth_options.engine.memory_gb = options.memory_gb / 2;
  PlaneFiles planes(writer.work_folder() / "planes");
  depth_options.planes = &planes;
  const auto view_of = [&](int source) -> View& {
    return views[static_cast<size_t>(sources[static_cast<size_t>(source)])];
  };
  stereo::ComputeDepthMaps(
      stereo_views, scene, *engine, depth_options, progress,
      [&](int source) { return view_of(source).depth_file.has_value(); },
      [&](int source, stereo::DepthEstimate&& estimate, const stereo::DepthRange&) {
        View& view = view_of(source);
        view.depth = std::move(estimate.depth);
        view.inverse_depth_sigma = std::move(estimate.inverse_depth_sigma);
        writer.WriteView(view, set.unit);
      });
  // What follows uses the stored maps, so that a resumed run and an undisturbed one agree.
  for (const int i : sources) {
    io::LoadOptions load;
    load.images = false;
    load.sigma = true;
    load.threads = options.threads;
    io::LoadPixels(writer.folder(), views[static_cast<size_t>(i)], load);
  }
}

}  // namespace dtr::pipeline
