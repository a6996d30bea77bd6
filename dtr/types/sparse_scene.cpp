#include "dtr/types/sparse_scene.h"

#include <stdexcept>

namespace dtr {

SparseScene RestrictToViews(const SparseScene& scene, const std::vector<bool>& keep) {
  std::vector<int> seen_by(scene.points.size(), 0);
  for (const SparseObservation& seen : scene.observations) {
    if (seen.view < 0 || static_cast<size_t>(seen.view) >= keep.size()) {
      throw std::invalid_argument("RestrictToViews: an observation names a view that is not there");
    }
    if (keep[static_cast<size_t>(seen.view)]) ++seen_by.at(static_cast<size_t>(seen.point));
  }
  SparseScene kept;
  std::vector<int> new_index(scene.points.size(), -1);
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (seen_by[i] < 2) continue;
    new_index[i] = static_cast<int>(kept.points.size());
    kept.points.push_back(scene.points[i]);
  }
  for (SparseObservation seen : scene.observations) {
    const int point = new_index[static_cast<size_t>(seen.point)];
    if (point < 0 || !keep[static_cast<size_t>(seen.view)]) continue;
    seen.point = point;
    kept.observations.push_back(seen);
  }
  return kept;
}

}  // namespace dtr
