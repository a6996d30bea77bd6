// calib/solve/board_scale.h -- how long a unit of a scene is, from a board that lies in it.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/observations.h"
#include "calib/similarity.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// An undistorted camera of a scene, and what it saw of the board.
struct BoardObservation {
  PinholeCamera camera;
  Pose cam_from_world;  ///< in scene units
  BoardView seen;
};

struct BoardScale {
  Similarity scene_from_board;  ///< its scale is scene units per unit of the board
  /// Standard deviation of that scale over itself: the larger of what the corners' scatter makes of
  /// it and of what leaving out single views does to it (jackknife; Efron & Tibshirani 1993, ch.
  /// 11). Errors that all cameras share are not in it.
  double relative_sigma = 0;
  double rms_px = 0;               ///< root mean squared residual length of the corners that count
  std::vector<std::string> views;  ///< that count
  int corners = 0, outliers = 0;   ///< of these views
  std::vector<LeftOut> left_out;
};

/// The similarity that carries the board to where the cameras, held as they are, saw it. It starts
/// from corners that are triangulated from two views; every pair is asked, and the one that most
/// views agree with is taken, so that some views of a board that lay elsewhere do no harm. Then
/// robust least squares over all corners, and plain least squares over those within 5 standard
/// deviations. A chessboard may have been counted from either end in each view.
/// The board must not move between the views. Throws Error with fewer than 3 views, where fewer
/// than 3 or than half of them agree, where no two see corners under an angle of a degree or more,
/// and where the scale would be uncertain by more than 10 %. Deterministic.
BoardScale ScaleFromBoard(const Board& board, std::span<const BoardObservation> observations);

}  // namespace dtr::calib
