// dtr/report/contact_sheet.h -- many images on one.
#pragma once
#include <span>

#include "dtr/types/grid.h"

namespace dtr::report {

/// The image made smaller so that its long side is at most `max_side_px`, each pixel the area mean
/// of what it covers (of sRGB values: for looking at); unchanged when it is small enough.
/// Throws std::invalid_argument unless max_side_px is positive.
ImageRgb8 Shrink(const ImageRgb8& image, int max_side_px);

/// Images in rows of `columns`, each shrunk into a square cell of `cell_px` and centred, on a
/// dark ground. Empty images leave their cell empty. An empty list gives an empty image.
/// Throws std::invalid_argument unless columns and cell_px are positive.
ImageRgb8 ContactSheet(std::span<const ImageRgb8> images, int columns, int cell_px);

}  // namespace dtr::report
