// stereo/complete/label_cells.h -- planes for the cells of a view that nothing was measured of.
#pragma once
#include <span>
#include <vector>

#include "stereo/complete/agreement.h"
#include "stereo/complete/cells.h"
#include "stereo/complete/scene_planes.h"

namespace dtr::stereo {

/// Candidates of a cell beside the planes of the scene: far, eight directions, two of other views,
/// the one at the smallest geodesic distance, that of its area's outline.
inline constexpr int kOwnLabels = 13;

/// What LabelCells weighs. Costs are in levels of sRGB.
struct LabelWeights {
  AgreementWeights agreement;
  float far = 0.2F;        ///< of the plane at infinity
  float jump = 50;         ///< of a jump of depth between neighbouring cells of one colour
  float jump_px = 2;       ///< cells of disparity from which on it is one
  float edge_levels = 12;  ///< difference of colours at which a jump costs 1/e
};

/// Planes of the cells without measured depth; all zero: far. Measured cells keep theirs.
struct CompletedCells {
  Grid<float> planes;  ///< 3 channels: ViewPlane
  ViewPlane PlaneAt(int x, int y) const {
    return {planes(x, y, 0), planes(x, y, 1), planes(x, y, 2)};
  }
};

/// `others`: neighbours of the view, best first. `completed`: what an earlier pass gave for these,
/// in their order; empty in the first pass. `by_outline`: OutlinePlanes of the view.
CompletedCells LabelCells(const CellView& view, std::span<const CellView* const> others,
                          std::span<const CompletedCells* const> completed,
                          std::span<const ScenePlane> planes, const Grid<float>& by_outline,
                          const LabelWeights& weights);

}  // namespace dtr::stereo
