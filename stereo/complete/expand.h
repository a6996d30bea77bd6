// stereo/complete/expand.h -- from planes of cells to depths of pixels.
#pragma once
#include <span>
#include <vector>

#include "dtr/types/depth_image.h"
#include "dtr/types/view.h"
#include "stereo/complete/cells.h"
#include "stereo/complete/label_cells.h"

namespace dtr::stereo {

/// Depth of every pixel that the view did not measure and that is not masked: on the plane of the
/// cells around that look like it. `far_z`: depth of the plane at infinity. 0 where measured.
DepthImage ExpandCells(const View& view, const CellView& cells, const CompletedCells& completed,
                       int cell_px, float far_z);

/// Takes back (NaN) the planes of cells without measured depth that the views around contradict:
/// what stays is a surface that another view has as well, measured or completed, or a place that
/// none shows.
CompletedCells KeepSupported(const CellView& view, const CompletedCells& completed,
                             std::span<const CellView* const> others,
                             std::span<const CompletedCells* const> completed_others, int mode,
                             float support_px);

}  // namespace dtr::stereo
