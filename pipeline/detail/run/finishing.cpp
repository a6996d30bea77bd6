#include "pipeline/detail/run/finishing.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/depth_io.h"
#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/geometry.h"
#include "dtr/render/options.h"
#include "dtr/render/scene.h"

namespace dtr::pipeline {
namespace {

// A copy of the view with its stored depth and, if wanted, image and mask.
View Loaded(const View& view, const io::SetWriter& writer, bool images, int threads,
            bool completed = false) {
  View loaded = view;
  io::LoadOptions load;
  load.images = images;
  load.completed = completed;
  load.threads = threads;
  io::LoadPixels(writer.folder(), loaded, load);
  return loaded;
}

bool HasDepth(const View& view) { return view.role == ViewRole::kSource && view.depth_file; }

// A stage over the views that have depth.
class ViewsDone {
 public:
  ViewsDone(const DtrSet& set, const std::string& stage, Progress& progress) : progress_(progress) {
    const auto& views = set.frames.front().views;
    progress.Stage(stage, static_cast<int>(std::count_if(views.begin(), views.end(), HasDepth)));
  }
  void OneMore() {
    progress_.Update(++done_);
    progress_.ThrowIfInterrupted();
  }

 private:
  Progress& progress_;
  std::atomic<int> done_ = 0;
};

}  // namespace

void FinishScene(DtrSet& set, std::span<const SparsePoint> points, const io::SetWriter& writer,
                 int threads, Progress& progress) {
  DepthSamples samples;
  ViewsDone done(set, "extent of the scene", progress);
  bool has_depth = false;
  for (const View& view : set.frames.front().views) {
    if (!HasDepth(view)) continue;
    has_depth = true;
    samples.Add(Loaded(view, writer, false, threads));
    done.OneMore();
  }
  FinishGeometry(set,
                 has_depth || points.empty() ? samples.Extent() : SceneExtentFromPoints(points));
}

void RecodeDepth(DtrSet& set, double error_px, io::SetWriter& writer, int threads, double memory_gb,
                 Progress& progress) {
  MemoryBudget memory(memory_gb);
  ViewsDone done(set, "coding depth", progress);
  std::vector<View>& views = set.frames.front().views;
  ParallelFor(0, static_cast<int>(views.size()), threads, [&](int i) {
    View& view = views[static_cast<size_t>(i)];
    if (!HasDepth(view)) return;
    const auto share = memory.TakeForPhoto(view.camera.width_px(), view.camera.height_px());
    View loaded = Loaded(view, writer, false, 1);
    if (!io::TrySetDepthError(loaded, error_px * ThresholdsOf(loaded, {}).pixel)) {
      throw Error(fmt::format(
          "`depth_error` {}: {}: expected a bound that 16 bits can keep over its depths of {:.4g} "
          "to {:.4g}; allow a larger one",
          error_px, view.name, view.near_z, view.far_z));
    }
    writer.RecodeDepth(loaded, set.unit);
    view.depth_coding = loaded.depth_coding;
    view.depth_steps = loaded.depth_steps;
    view.depth_file = loaded.depth_file;
    view.mesh_file.reset();
    done.OneMore();
  });
}

DepthCount WriteMeshes(DtrSet& set, io::SetWriter& writer, int threads, Progress& progress) {
  DepthCount count;
  ViewsDone done(set, "meshes", progress);
  for (View& view : set.frames.front().views) {
    if (!HasDepth(view)) continue;
    const View loaded = Loaded(view, writer, true, threads, true);
    writer.WriteMesh(view, MakeStoredMesh(loaded, RenderOptions{}, threads));
    ++count.maps;
    const DepthImage measured = MeasuredDepth(loaded);
    for (const float z : measured.grid().data()) count.with_depth += !DepthImage::IsHole(z);
    count.pixels += static_cast<long>(loaded.depth.grid().data().size());
    done.OneMore();
  }
  return count;
}

}  // namespace dtr::pipeline
