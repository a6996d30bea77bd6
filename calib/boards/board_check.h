// calib/boards/board_check.h -- do photos show the board that was given, or another one?
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "calib/boards/board.h"
#include "dtr/types/grid.h"

namespace dtr::calib {

/// What one photo says about the board that was given. Neither field is set where it says nothing.
struct BoardCheck {
  bool shows_given = false;
  Board other;  ///< shown in its place: kind, size and dictionary; columns 0: none is recognised
  bool first_square_white = false;  ///< OpenCV's layout before 4.6 (setLegacyPattern of later ones)
};

/// A part of a larger chessboard passes for a smaller one, and a ChArUco board with another number
/// of columns gives corners in wrong places: what a photo shows is found without knowing `given`.
BoardCheck CheckBoard(const Grid<std::uint8_t>& grey, const Board& given);

/// One line saying which board the photos show and how to give it; empty unless no photo shows the
/// given one and half of those that show any agree on another.
std::string DescribeOtherBoard(const Board& given, std::span<const BoardCheck> checks);

}  // namespace dtr::calib
