// stereo/complete/support.h -- what other views say of completed cells.
#pragma once
#include <span>

#include "stereo/complete/cells.h"
#include "stereo/complete/label_cells.h"

namespace dtr::stereo {

/// Takes back the planes of cells without measured depth that the views around contradict. What
/// stays is a surface that another view has as well, measured or completed, or a place that none
/// of them shows. `completed_others` is in the order of `others`.
CompletedCells KeepSupported(const CellView& view, const CompletedCells& completed,
                             std::span<const CellView* const> others,
                             std::span<const CompletedCells* const> completed_others);

}  // namespace dtr::stereo
