// calib/boards/board.h -- flat calibration boards and where their corners are.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace dtr::calib {

/// A chessboard, or a chessboard with markers in its white squares (ChArUco), of which a part is
/// enough. Corners are the inner ones, where four squares meet: corner id = row * columns + column.
/// Frame `board`: x along a row, y along a column, z = 0; corner (column, row) of a chessboard lies
/// at (column, row) * square, of a ChArUco board at (column + 1, row + 1) * square, OpenCV's
/// origins.
struct Board {
  enum class Kind { kChessboard, kCharuco };
  Kind kind = Kind::kChessboard;
  int columns = 0, rows = 0;  ///< inner corners
  double square = 0;          ///< side of a square, in the unit of all that is computed from it
  // ChArUco alone:
  double marker_share = 0;  ///< side of a marker over side of a square
  std::string dictionary;   ///< OpenCV's name: "DICT_4X4_1000"
  bool inverted = false;    ///< printed white on black
  bool metric = false;      ///< `square` is in metres; else in a unit that is the user's own

  int CornerCount() const { return columns * rows; }
  Eigen::Vector3d Corner(int id) const;
  bool operator==(const Board&) const = default;
};

/// Reads `chessboard:WxH:SQUARE` (W x H inner corners) or
/// `charuco:WxH:SQUARE:MARKER[:DICTIONARY][:inverted]` (W x H squares, as such boards are
/// described; MARKER a share of the square below 1, or a length when it ends in a unit of length as
/// SQUARE does; DICTIONARY defaults to DICT_4X4_50). Lengths may end in mm, cm or m and are then
/// metres. Throws UsageError saying what was expected.
Board BoardFromText(const std::string& text);

/// The inverse of BoardFromText, lengths in metres (`0.025m`) or without a unit.
std::string TextOf(const Board& board);

/// Throws Error, starting with `where`, unless sizes are within 2..1000, lengths positive and
/// finite, and the dictionary known.
void CheckBoard(const Board& board, const std::string& where);

/// OpenCV's number of a dictionary by its name; -1 for unknown ones.
int DictionaryNumber(const std::string& name);

}  // namespace dtr::calib
