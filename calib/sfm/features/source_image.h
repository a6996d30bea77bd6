// calib/sfm/features/source_image.h -- grey photos as floats, shrunk where they are too large.
#pragma once
#include <cstdint>
#include <span>

#include "calib/sfm/features/row_store.h"

namespace dtr::sfm {

/// Values 0 to 1 on a grid of new_width x new_height pixels over the same area, each the mean over
/// the rectangle its pixel covers. Values are divided by `white`, clamped to [0, 1], NaN is 0.
/// Requires that the new sizes are positive and not above the old.
RowStore SourceImage(std::span<const std::uint8_t> grey, int width, int height, int new_width,
                     int new_height);
RowStore SourceImage(std::span<const float> grey, int width, int height, int new_width,
                     int new_height);

}  // namespace dtr::sfm
