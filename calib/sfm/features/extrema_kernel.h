// calib/sfm/features/extrema_kernel.h -- extrema of the difference of Gaussians.
#pragma once
#include <array>
#include <vector>

namespace dtr::sfm {

/// Three scales, finest first, of three rows of a difference of Gaussians, top first.
using ScaleRows = std::array<std::array<const float*, 3>, 3>;

/// Appends the columns in [1, width - 1) whose value in the middle row of the middle scale is at
/// least `min_contrast` from 0 and, with its sign, larger than all its 26 neighbours. Rows may be
/// read up to a multiple of RowStore::kRowUnit. NaN is no extremum.
void FindExtrema(const ScaleRows& rows, int width, float min_contrast, std::vector<int>* columns);

}  // namespace dtr::sfm
