// calib/validation/image_shift.h -- internal to calib/bundle: what a calibration's uncertainty does
// to the picture.
#pragma once
#include <vector>

#include "calib/validation/photos.h"

namespace dtr::calib {

/// Fills in `placed` and `picture_shift_px` of every image's judgement (TransferCovariance).
void PictureShifts(const Adjusted& fresh, const BundleCovariance& covariance, int threads,
                   std::vector<PhotoValidation>& cameras);

}  // namespace dtr::calib
