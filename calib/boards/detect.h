// calib/boards/detect.h -- finds a board in an image.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/observations.h"
#include "dtr/types/grid.h"

namespace dtr::calib {

/// How whole chessboards are found. Both ways end in the same sub-pixel refinement.
enum class ChessboardDetector {
  kAuto,     ///< quads, and sectors where these find nothing
  kQuads,    ///< OpenCV's findChessboardCorners: contours of the squares
  kSectors,  ///< OpenCV's findChessboardCornersSB (Duda & Frese 2018): slower; blur and noise
};

struct DetectOptions {
  ChessboardDetector detector = ChessboardDetector::kAuto;
  /// Half of the side of the square window that a corner is refined in, at most; it shrinks where
  /// neighbouring corners or markers are close. OpenCV's usual window is 7.
  int half_window_px = 7;
};

/// The corners found, or the reason why there are none.
struct Detection {
  std::vector<BoardCorner> corners;  ///< empty: not found
  double noise_px = 0;               ///< BoardView::noise_px
  std::string reason;                ///< one line, where not found
};

/// A photo as the detectors take it: luma (BT.601) of sRGB values.
Grid<std::uint8_t> GreyOf(const ImageRgb8& image);

/// Looks for the board. Chessboards have no marks that tell corners apart: they must be seen whole.
/// Of ChArUco boards any part with at least 4 corners that are not on a line will do.
/// Corners are refined to where the image gradients around them are orthogonal to the way to the
/// corner (Förstner & Gülch 1987, by OpenCV's cornerSubPix).
Detection DetectBoard(const Grid<std::uint8_t>& grey, const Board& board,
                      const DetectOptions& options = {});

}  // namespace dtr::calib
