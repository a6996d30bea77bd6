#include "pipeline/core/run/finishing.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/io/depth_io.h"
#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/geometry.h"
#include "dtr/render/options.h"
#include "dtr/render/scene.h"

namespace dtr::pipeline {
void FinishScene(DtrSet& set, std::span<const SparsePoint> points, const io::SetWriter& writer,
                 double memory_gb, Progress& progress) {
  const std::vector<View>& views = set.frames.front().views;
  const std::vector<int> which = ViewsWithDepth(views);
  std::vector<DepthSamples> samples(which.size());
  ForViews(views, which, "extent of the scene", memory_gb, progress, [&](size_t k) {
    samples[k].Add(
        Loaded(views[static_cast<size_t>(which[k])], writer.folder(), {.images = false}));
  });
  DepthSamples all;
  for (const DepthSamples& of_view : samples) all.Append(of_view);
  FinishGeometry(set,
                 !which.empty() || points.empty() ? all.Extent() : SceneExtentFromPoints(points));
}

void RecodeDepth(DtrSet& set, double error_px, io::SetWriter& writer, double memory_gb,
                 Progress& progress) {
  std::vector<View>& views = set.frames.front().views;
  const std::vector<int> which = ViewsWithDepth(views);
  ForViews(views, which, "coding depth", memory_gb, progress, [&](size_t k) {
    View& view = views[static_cast<size_t>(which[k])];
    View loaded = Loaded(view, writer.folder(), {.images = false});
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
  });
}

DepthCount WriteMeshes(DtrSet& set, io::SetWriter& writer, double memory_gb, Progress& progress) {
  std::vector<View>& views = set.frames.front().views;
  const std::vector<int> which = ViewsWithDepth(views);
  std::atomic<long> with_depth = 0, pixels = 0;
  ForViews(views, which, "meshes", memory_gb, progress, [&](size_t k) {
    View& view = views[static_cast<size_t>(which[k])];
    const View loaded = Loaded(view, writer.folder(), {.completed = true});
    writer.WriteMesh(view, MakeStoredMesh(loaded, RenderOptions{}));
    const auto measured = MeasuredDepth(loaded).grid().data();
    with_depth += std::ranges::count_if(measured, [](float z) { return !DepthImage::IsHole(z); });
    pixels += static_cast<long>(measured.size());
  });
  return {static_cast<int>(which.size()), with_depth, pixels};
}

}  // namespace dtr::pipeline
