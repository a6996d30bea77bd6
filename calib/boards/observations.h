// calib/boards/observations.h -- what a detector saw of a board.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace dtr::calib {

/// A board corner where the image shows it. Pixels: origin at the outer corner of the top-left one.
struct BoardCorner {
  int id = 0;  ///< as Board::Corner counts
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// How a program had rotated the pixels of a photo whose corners are given on the sensor's grid.
enum class PhotoRotation {
  kNone,
  kClockwise,         ///< the sensor's left edge is the photo's top
  kCounterclockwise,  ///< the sensor's right edge is the photo's top
};

/// Clockwise, 0 where there is none.
inline int DegreesOf(PhotoRotation rotation) {
  if (rotation == PhotoRotation::kNone) return 0;
  return rotation == PhotoRotation::kClockwise ? 90 : 270;
}

/// Photos by how they were rotated.
struct RotationCounts {
  int clockwise = 0, counterclockwise = 0;

  void Add(PhotoRotation rotation) {
    if (rotation == PhotoRotation::kClockwise) ++clockwise;
    if (rotation == PhotoRotation::kCounterclockwise) ++counterclockwise;
  }
};

/// The board in one image.
struct BoardView {
  std::string name;                  ///< of the image
  std::vector<BoardCorner> corners;  ///< rising ids, each once; not all need be there
  /// Standard deviation of a coordinate of a corner, from the image alone (corner_noise.h); not a
  /// number where it could not be told.
  double noise_px = 0;
  PhotoRotation rotation = PhotoRotation::kNone;  ///< taken out of the corners already
};

/// An image that is not used, and why.
struct LeftOut {
  std::string name, reason;
};

}  // namespace dtr::calib
