// stereo/complete/outline_planes.h -- surfaces without texture, by how their outlines move.
#pragma once
#include <span>
#include <vector>

#include "stereo/complete/cells.h"
#include "stereo/complete/scene_planes.h"

namespace dtr::stereo {

/// Areas of one colour among the cells that nothing was measured of (Felzenszwalb and Huttenlocher,
/// Efficient graph-based image segmentation, IJCV 2004). Of each cell, row by row, the number of
/// its area; -1 where something was measured or the cell is masked.
std::vector<int> AreasOfOneColour(const CellView& view);

/// Gives each cell without measured depth a plane on which the outline of its area lies at the same
/// place in all views: planes that face the camera and such parallel to those of the scene are
/// swept through the area. Where a surface that was measured nearer ends, the outline is that
/// surface's, and says nothing. 3 channels: ViewPlane; zero where no plane is much better than
/// others. `others`: neighbours of the view, best first.
Grid<float> OutlinePlanes(const CellView& view, std::span<const CellView* const> others,
                          std::span<const ScenePlane> planes);

}  // namespace dtr::stereo
