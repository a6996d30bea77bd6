// calib/boards/opencv_images.h -- our images as OpenCV's.
#pragma once
#include <cstdint>
#include <opencv2/core.hpp>

#include "dtr/types/grid.h"

namespace dtr::calib {

/// The pixels of `grey` without a copy; only to be read.
inline cv::Mat Borrowed(const Grid<std::uint8_t>& grey) {
  return cv::Mat(grey.height(), grey.width(), CV_8UC1,
                 const_cast<std::uint8_t*>(grey.data().data()));
}

/// A copy: OpenCV evaluates `image = 255 - image` in place, in pixels that are only borrowed.
inline cv::Mat Inverted(const cv::Mat& image) {
  cv::Mat inverted;
  cv::bitwise_not(image, inverted);
  return inverted;
}

}  // namespace dtr::calib
