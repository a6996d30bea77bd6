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

/// The board in one image.
struct BoardView {
  std::string name;                  ///< of the image
  std::vector<BoardCorner> corners;  ///< rising ids, each once; not all need be there
  /// Standard deviation of a coordinate of a corner, from the image alone (corner_noise.h); not a
  /// number where it could not be told.
  double noise_px = 0;
};

/// An image that is not used, and why.
struct LeftOut {
  std::string name, reason;
};

}  // namespace dtr::calib
