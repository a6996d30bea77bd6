// stereo/scene_index.h -- sparse observations grouped by view; internal to stereo/.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "dtr/types/sparse_scene.h"
#include "stereo/engine.h"

namespace dtr::stereo {

/// Point indices each view observes, sorted, each once.
/// Throws std::invalid_argument for an observation of a view or point that does not exist.
std::vector<std::vector<int>> PointsOfViews(const SparseScene& scene, size_t view_count);

/// Points of the scene that lie in front of the view and project into its image.
std::vector<int> PointsInFrustum(const StereoView& view, const SparseScene& scene);

/// The q-quantile (q in [0, 1]) of a non-empty list, by nearest rank.
double Quantile(std::vector<double> values, double q);

}  // namespace dtr::stereo
