// calib/boards/shown_board.h -- which board does a photo show, if not the one that was given?
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr::calib {

/// Inner corners along both sides of a chessboard.
struct GridSize {
  int columns = 0, rows = 0;
  bool operator==(const GridSize&) const = default;
};

struct ShownChessboard {
  GridSize size;
  std::vector<Eigen::Vector2d> corners;  ///< pixels, in no order
};

/// The largest chessboard in a photo, whatever its size; empty where there is none of at least
/// 3 x 3 corners. A lattice grows from corner to corner, each of which shows two opposite
/// quadrants dark and two bright. In either order of sides.
std::optional<ShownChessboard> FindChessboard(const Grid<std::uint8_t>& grey);

/// Markers in a photo, and the ChArUco board that they lie on.
struct ShownMarkers {
  std::string dictionary;  ///< OpenCV's name of the smallest of its family that has all the ids
  int count = 0, largest_id = 0;
  /// Squares; 0 where fewer than 6 markers lie like those of a board. `rows` reaches to the largest
  /// id: the board may have more that the photo does not show.
  int columns = 0, rows = 0;
  bool first_square_white = false;  ///< as OpenCV before 4.6 made boards of an even number of rows
};

/// Markers of the dictionary in which they lie like those of a board, or else of which there are
/// most; of all families or, where it is not empty,
/// of that of `dictionary` alone; empty without markers.
std::optional<ShownMarkers> MarkersShown(const Grid<std::uint8_t>& grey, bool inverted,
                                         const std::string& dictionary = "");

/// The family of a dictionary of OpenCV: "DICT_4X4" of "DICT_4X4_50".
std::string FamilyOf(const std::string& dictionary);

}  // namespace dtr::calib
