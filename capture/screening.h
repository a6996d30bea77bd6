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

/// Of photos of one image (indices, rising) the one to use: not blurred or merely enlarged (less
/// than a quarter of another's sharpness), of the most pixels, with a camera's EXIF data, of the
/// most bytes (of one format; a messenger's copy is smaller), the first; of equal files the one
/// with the shortest name. All screened.
size_t BestCopy(const std::vector<Photo>& photos, const std::vector<size_t>& copies);

/// Compares the photos with each other: names duplicates, faults and remarks, in place of those
/// that were there. Photos show one image where they have the same bytes, or where the thumbnail of
/// one among the 100 before differs by less than 3 % of the later one's contrast (root mean
/// squares): an image that moved by more than about 0.15 % of its width differs by more. All of
/// them are duplicates of their BestCopy.
void ScreenPhotos(std::vector<Photo>& photos);

}  // namespace dtr::capture
