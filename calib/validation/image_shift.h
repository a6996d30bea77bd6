// calib/validation/image_shift.h -- internal to calib/validation: what a calibration's uncertainty
// does to the image.
#pragma once
#include <vector>

#include "calib/validation/photos.h"

namespace dtr::calib {

/// Fills in `placed` and `image_shift_px` of every image's validation result (TransferCovariance).
void ImageShifts(const Adjusted& fresh, const BundleCovariance& covariance,
                 std::vector<PhotoValidation>& cameras);

}  // namespace dtr::calib
