#include "pipeline/dynamic/detail/still_completion.h"

#include <algorithm>
#include <utility>

#include "pipeline/core/depth/source_scene.h"

namespace dtr::pipeline {
namespace {

/// Indices of the source views; the backgrounds are in this order.
std::vector<int> SourceIndices(const std::vector<View>& views) {
  std::vector<int> sources;
  for (size_t i = 0; i < views.size(); ++i) {
    if (views[i].role == ViewRole::kSource) sources.push_back(static_cast<int>(i));
  }
  return sources;
}

size_t PositionOf(size_t view, const std::vector<View>& views) {
  return static_cast<size_t>(
      std::count_if(views.begin(), views.begin() + static_cast<std::ptrdiff_t>(view),
                    [](const View& v) { return v.role == ViewRole::kSource; }));
}

}  // namespace

StillCompletion::StillCompletion(BackgroundViews backgrounds, const SparseScene& points,
                                 const std::vector<View>& views, io::SetWriter& writer,
                                 double memory_gb, Progress& progress)
    : backgrounds_(std::move(backgrounds)), writer_(writer) {
  planes_ = CompleteDepth(backgrounds_.set, SourceScene(points, views, SourceIndices(views)),
                          writer, memory_gb, progress);
}

KnownCompletion StillCompletion::Of(const std::vector<View>& views) const {
  const std::vector<View>& behind = backgrounds_.set.frames.front().views;
  // Without memory for it, or depth, the backgrounds were not completed.
  if (std::ranges::any_of(behind, [](const View& view) { return !view.completed_file; })) return {};
  return {[this, &views](size_t view, const View& loaded) {
            return Known(PositionOf(view, views), loaded);
          },
          [&views, &behind](size_t view) {
            return std::min(views[view].near_z, behind[PositionOf(view, views)].completed_near_z);
          },
          planes_};
}

DepthImage StillCompletion::Known(size_t source, const View& loaded) const {
  View behind = backgrounds_.set.frames.front().views[source];
  io::LoadOptions load;
  load.completed = true;
  io::LoadPixels(writer_.folder(), behind, load);
  const Mask open = OpenPixels(behind, loaded, writer_);
  DepthImage known = CompletedDepth(behind);
  for (int y = 0; y < known.height(); ++y) {
    for (int x = 0; x < known.width(); ++x) {
      const bool settled = open(x * loaded.depth_scale, y * loaded.depth_scale) == 0;
      if (!settled || !DepthImage::IsHole(loaded.depth(x, y))) known(x, y) = 0;
    }
  }
  return known;
}

}  // namespace dtr::pipeline
