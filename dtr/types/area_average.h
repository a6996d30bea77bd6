// dtr/types/area_average.h -- smaller images by exact area averages.
#pragma once
#include <utility>

#include "dtr/types/grid.h"

namespace dtr {

/// Size (width, height) of an image whose long side may be at most `max_size_px`; the short side is
/// rounded to the nearest pixel, at least 1. Unchanged where it fits already or max_size_px is 0.
/// Throws std::invalid_argument when a size is not positive or the limit is negative.
std::pair<int, int> TargetSize(int width_px, int height_px, int max_size_px);

/// The image on a grid of new_width x new_height pixels over the same area. Each value is the mean
/// over the rectangle its pixel covers, in stored (sRGB) values as published comparisons do, exact
/// but for the last rounding to the nearest integer (halves up): integer arithmetic, so the same on
/// every machine. Throws std::invalid_argument when a new size is not positive or is larger than
/// the old.
Grid<std::uint8_t> AreaAverage(const Grid<std::uint8_t>& image, int new_width_px,
                               int new_height_px);

/// The mask of such a smaller image: usable (255) where every pixel that the rectangle touches is
/// usable, since its mean would mix in what has no source. Throws like AreaAverage.
Mask ShrinkMask(const Mask& mask, int new_width_px, int new_height_px);

}  // namespace dtr
