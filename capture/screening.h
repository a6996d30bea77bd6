// capture/screening.h -- simple measures of how usable a photo is.
#pragma once
#include <vector>

#include "capture/photo.h"

namespace dtr::capture {

/// Sharpness and clipping of a photo (its pixels only: no duplicates, no remarks).
Screening MeasurePhoto(const ImageRgb8& photo);

/// Compares the photos with each other: names duplicates and adds the remarks.
void JudgePhotos(std::vector<Photo>& photos);

}  // namespace dtr::capture
