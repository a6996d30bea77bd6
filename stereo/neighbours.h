// stereo/neighbours.h -- which other views help to find the depth of a view.
#pragma once
#include <span>
#include <vector>

#include "dtr/types/sparse_scene.h"
#include "stereo/engine.h"

namespace dtr::stereo {

struct NeighbourOptions {
  int count = 5;  ///< at most so many neighbours per view
  /// Pairs whose median triangulation angle is less serve only views that have no other pair.
  double min_angle_deg = 1.0;
};

/// What a choice of neighbours was based on.
enum class NeighbourEvidence {
  kSharedPoints,  ///< sparse points that both views observe
  kGeometry,      ///< too few observations: a guess from the cameras (and any points) alone
};

/// Neighbours of one view.
struct ViewNeighbours {
  std::vector<int> views;  ///< indices of other views, best first; may be empty
  NeighbourEvidence evidence = NeighbourEvidence::kSharedPoints;
  int strangers = 0;  ///< other views left out because they share fewer than 4 points
};

/// Chooses the neighbours of every view.
/// A pair's score is the sum over its shared points of a weight of the triangulation angle (a
/// piecewise Gaussian as in Yao et al., MVSNet, ECCV 2018, supplement sec. 1.1: small angles give
/// no depth, large ones different images) times a weight of the ratio of the image scales.
/// A view with too few observations is scored with stand-in points instead: the points of the whole
/// scene inside its frustum, or, without any, a grid of rays at depths guessed from the cameras.
/// Long lenses and far scenes may have no pair of min_angle_deg at all: their pairs are ranked by
/// score times angle, for what a pair says about depth grows with its baseline.
/// Equal scores are ordered by index. Pairs with a (nearly) common centre are never chosen.
/// Throws std::invalid_argument when the scene names a view or point that does not exist.
std::vector<ViewNeighbours> ChooseNeighbours(std::span<const StereoView> views,
                                             const SparseScene& scene,
                                             const NeighbourOptions& options);

}  // namespace dtr::stereo
