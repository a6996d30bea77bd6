#include "pipeline/core/depth/source_scene.h"

#include <utility>

#include "stereo/neighbours.h"

namespace dtr::pipeline {

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

std::vector<std::vector<int>> NeighboursOf(const std::vector<View>& views,
                                           const std::vector<int>& sources,
                                           const SparseScene& scene, int count) {
  std::vector<stereo::StereoView> cameras;
  for (const int s : sources) {
    const View& view = views[static_cast<size_t>(s)];
    cameras.push_back({view.camera, view.cam_from_world, nullptr, nullptr});
  }
  stereo::NeighbourOptions options;
  options.count = count;
  std::vector<std::vector<int>> neighbours;
  for (auto& of_view : stereo::ChooseNeighbours(cameras, scene, options)) {
    neighbours.push_back(std::move(of_view.views));
  }
  return neighbours;
}

}  // namespace dtr::pipeline
