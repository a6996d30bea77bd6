#include "pipeline/detail/depth/source_scene.h"

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

}  // namespace dtr::pipeline
