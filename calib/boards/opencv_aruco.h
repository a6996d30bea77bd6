// calib/boards/opencv_aruco.h -- internal: ChArUco boards of OpenCV 4.6, and of 4.7 and later,
// where boards and dictionaries are values and print() has another name.
#pragma once
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core/version.hpp>
#include <string>

#include "calib/boards/board.h"

#define DTR_ARUCO_OF_4_6 (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR < 7)

namespace dtr::calib {

/// A dictionary that DictionaryNumber() knows.
inline cv::Ptr<cv::aruco::Dictionary> MarkersOf(const std::string& dictionary) {
#if DTR_ARUCO_OF_4_6
  return cv::aruco::getPredefinedDictionary(DictionaryNumber(dictionary));
#else
  return cv::makePtr<cv::aruco::Dictionary>(
      cv::aruco::getPredefinedDictionary(DictionaryNumber(dictionary)));
#endif
}

/// A ChArUco board with squares of side 1. Its top left square is black; versions before 4.6
/// printed it white where the number of rows is even.
inline cv::Ptr<cv::aruco::CharucoBoard> CharucoOf(const Board& board,
                                                  const cv::Ptr<cv::aruco::Dictionary>& markers) {
  const cv::Size squares(board.columns + 1, board.rows + 1);
  const auto share = static_cast<float>(board.marker_share);
#if DTR_ARUCO_OF_4_6
  return cv::aruco::CharucoBoard::create(squares.width, squares.height, 1.0f, share, markers);
#else
  return cv::makePtr<cv::aruco::CharucoBoard>(squares, 1.0f, share, *markers);
#endif
}

/// What a printer prints of it, without a margin.
inline cv::Mat PrintOf(const cv::Ptr<cv::aruco::CharucoBoard>& board, cv::Size size_px) {
  cv::Mat print;
#if DTR_ARUCO_OF_4_6
  board->draw(size_px, print, 0, 1);
#else
  board->generateImage(size_px, print, 0, 1);
#endif
  return print;
}

}  // namespace dtr::calib
