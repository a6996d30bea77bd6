// calib/boards/opencv_pixels.h -- where OpenCV has pixel centres.
#pragma once

namespace dtr::calib {

/// OpenCV has pixel centres at whole numbers, we at halves: our pixel = its pixel + this.
inline constexpr double kOpenCvOffsetPx = 0.5;

}  // namespace dtr::calib
