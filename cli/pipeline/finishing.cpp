#include "cli/pipeline/finishing.h"

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/geometry.h"
#include "dtr/render/options.h"

namespace dtr::pipeline {
namespace {

// A copy of the view with its stored depth and, if wanted, image and mask.
View Loaded(const View& view, const io::SetWriter& writer, bool images, int threads) {
  View loaded = view;
  io::LoadOptions load;
  load.images = images;
  load.threads = threads;
  io::LoadPixels(writer.folder(), loaded, load);
  return loaded;
}

bool HasDepth(const View& view) { return view.role == ViewRole::kSource && view.depth_file; }

}  // namespace

void FinishScene(DtrSet& set, std::span<const SparsePoint> points, const io::SetWriter& writer,
                 int threads) {
  DepthSamples samples;
  bool has_depth = false;
  for (const View& view : set.frames.front().views) {
    if (!HasDepth(view)) continue;
    has_depth = true;
    samples.Add(Loaded(view, writer, false, threads));
  }
  FinishGeometry(set,
                 has_depth || points.empty() ? samples.Extent() : SceneExtentFromPoints(points));
}

DepthCount WriteMeshes(DtrSet& set, io::SetWriter& writer, int threads) {
  DepthCount count;
  for (View& view : set.frames.front().views) {
    if (!HasDepth(view)) continue;
    const View loaded = Loaded(view, writer, true, threads);
    writer.WriteMesh(view, MakeStoredMesh(loaded, RenderOptions{}, threads));
    ++count.maps;
    for (const float z : loaded.depth.grid().data()) count.with_depth += !DepthImage::IsHole(z);
    count.pixels += static_cast<long>(loaded.depth.grid().data().size());
  }
  return count;
}

}  // namespace dtr::pipeline
