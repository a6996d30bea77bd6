// capture/screening.h -- simple measures of how usable a photo is.
#pragma once
#include <vector>

#include "capture/photo.h"

namespace dtr::capture {

/// Screening::sharpness, of the usable pixels whose neighbours are usable too (`mask` empty: all).
double Sharpness(const ImageRgb8& photo, const Mask& mask = {});

/// Luma of the whole photo in 1/256 levels, on a grid of at most `side_px` along its long side.
Grid<std::uint16_t> SmallLuma(const ImageRgb8& photo, int side_px);

/// Sharpness, clipping and thumbnail of a photo (its pixels only: no duplicates, no remarks). What
/// the mask leaves out counts in no share and no sharpness; empty: all of the photo is usable.
Screening MeasurePhoto(const ImageRgb8& photo, const Mask& mask = {});

/// Compares the photos with each other: names duplicates, faults and remarks, in place of those
/// that were there. A photo is a duplicate of an earlier one that has the same bytes, or of one
/// among the 100 before it whose thumbnail differs by less than 3 % of its own contrast (root mean
/// squares): an image that moved by more than about 0.15 % of its width differs by more.
void ScreenPhotos(std::vector<Photo>& photos);

}  // namespace dtr::capture
