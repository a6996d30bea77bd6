// stereo/complete/expand.h -- from planes of cells to depths of pixels.
#pragma once
#include "dtr/types/depth_image.h"
#include "dtr/types/view.h"
#include "stereo/complete/cells.h"
#include "stereo/complete/label_cells.h"

namespace dtr::stereo {

/// Depth of every pixel that the loaded view (image, mask, measured depth) has none of and that is
/// not masked, on the grid of its depth map: on the plane of the cells around that look like the
/// pixel; 0 elsewhere. What lies at `far_z` or beyond gets `far_z`.
DepthImage ExpandCells(const View& view, const CellView& cells, const CompletedCells& completed,
                       float far_z);

}  // namespace dtr::stereo
