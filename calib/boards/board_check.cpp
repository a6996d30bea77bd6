#include "calib/boards/board_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "calib/boards/detect.h"
#include "calib/boards/shown_board.h"

namespace dtr::calib {
namespace {

constexpr int kMinVotes = 2;  // one photo may be of something else
constexpr double kSameCornerPx = 2;

bool SameSides(const GridSize& a, const GridSize& b) {
  return std::minmax(a.columns, a.rows) == std::minmax(b.columns, b.rows);
}

bool ReachesBeyond(const GridSize& shown, const GridSize& given) {
  return std::max(shown.columns, shown.rows) > std::max(given.columns, given.rows) ||
         std::min(shown.columns, shown.rows) > std::min(given.columns, given.rows);
}

// In the order of sides that a given chessboard has: photos show either.
Board ChessboardOf(GridSize size, const Board& given) {
  const bool upright = given.kind == Board::Kind::kChessboard && given.columns < given.rows;
  const auto [shorter, longer] = std::minmax(size.columns, size.rows);
  Board board;
  board.columns = upright ? shorter : longer;
  board.rows = upright ? longer : shorter;
  return board;
}

Board CharucoOf(const ShownMarkers& shown, bool inverted) {
  Board board;
  board.kind = Board::Kind::kCharuco;
  board.columns = shown.columns - 1;
  board.rows = shown.rows - 1;
  board.dictionary = shown.dictionary;
  board.inverted = inverted;
  return board;
}

// A photo may show fewer rows than the board has.
bool CanBe(const ShownMarkers& shown, bool inverted, const Board& given) {
  return FamilyOf(shown.dictionary) == FamilyOf(given.dictionary) && inverted == given.inverted &&
         shown.columns == given.columns + 1 && shown.rows <= given.rows + 1;
}

BoardCheck CheckMarkers(const Grid<std::uint8_t>& grey, const Board& given,
                        const std::string& dictionary, bool inverted) {
  BoardCheck check;
  const auto shown = MarkersShown(grey, inverted, dictionary);
  if (!shown || shown->columns == 0) return check;
  check.first_square_white = shown->first_square_white;
  check.shows_given = CanBe(*shown, inverted, given) && !shown->first_square_white;
  if (check.shows_given) return check;
  check.other = CharucoOf(*shown, inverted);
  // Dictionaries of one family begin with the same markers: the given one is not wrong.
  const bool fits = FamilyOf(shown->dictionary) == FamilyOf(given.dictionary) &&
                    DictionaryNumber(shown->dictionary) <= DictionaryNumber(given.dictionary);
  if (fits) check.other.dictionary = given.dictionary;
  return check;
}

bool SaysNothing(const BoardCheck& check) { return !check.shows_given && check.other.columns == 0; }

BoardCheck CheckAnyMarkers(const Grid<std::uint8_t>& grey, const Board& given) {
  BoardCheck check = CheckMarkers(grey, given, "", given.inverted);
  if (SaysNothing(check)) check = CheckMarkers(grey, given, "", !given.inverted);
  return check;
}

// By quads: OpenCV's other detector takes seconds for a size that is not shown.
std::vector<BoardCorner> CornersOf(const Grid<std::uint8_t>& grey, const Board& given) {
  DetectOptions options;
  options.detector = ChessboardDetector::kQuads;
  return DetectBoard(grey, given, options).corners;
}

// True where the corners are those of the lattice, not of another board in the photo.
bool LieOn(const std::vector<BoardCorner>& corners, const ShownChessboard& lattice) {
  const auto on_lattice = std::count_if(corners.begin(), corners.end(), [&](const auto& corner) {
    return std::any_of(lattice.corners.begin(), lattice.corners.end(), [&](const auto& pixel) {
      return (pixel - corner.pixel).norm() < kSameCornerPx;
    });
  });
  return 2 * static_cast<size_t>(on_lattice) > corners.size();
}

// What is seen may be less than the given board, of which reflections hide lines, and the largest
// board in a photo may be one in the background: the given one is looked for as well.
BoardCheck CheckChessboard(const Grid<std::uint8_t>& grey, const Board& given) {
  BoardCheck check;
  const auto shown = FindChessboard(grey);
  if (!shown) return check;
  if (given.kind == Board::Kind::kChessboard) {
    const GridSize size{given.columns, given.rows};
    check.shows_given = SameSides(shown->size, size);
    if (!check.shows_given) {
      const auto corners = CornersOf(grey, given);
      check.shows_given =
          !corners.empty() && !(ReachesBeyond(shown->size, size) && LieOn(corners, *shown));
    }
  }
  if (!check.shows_given) check.other = ChessboardOf(shown->size, given);
  return check;
}

bool Agree(const BoardCheck& a, const BoardCheck& b) {
  if (a.other.kind != b.other.kind || a.other.columns != b.other.columns) return false;
  if (a.other.kind == Board::Kind::kChessboard) return a.other.rows == b.other.rows;
  return FamilyOf(a.other.dictionary) == FamilyOf(b.other.dictionary) &&
         a.other.inverted == b.other.inverted && a.first_square_white == b.first_square_white;
}

std::string SizeText(const Board& board) {
  if (board.kind == Board::Kind::kChessboard) {
    return fmt::format("a chessboard of {}x{} inner corners", board.columns, board.rows);
  }
  return fmt::format("a ChArUco board of {}x{} squares, {}{}", board.columns + 1, board.rows + 1,
                     board.dictionary, board.inverted ? ", inverted" : "");
}

std::string Advice(const Board& given, const Board& other, bool first_square_white) {
  if (first_square_white) {
    return "its first square is white, as OpenCV before 4.6 made boards with an even number of "
           "rows: "
           "print the board again";
  }
  if (other.kind == Board::Kind::kCharuco) {
    return fmt::format("give charuco:{}x{}:SQUARE:MARKER:{}{}{}", other.columns + 1, other.rows + 1,
                       other.dictionary, other.inverted ? ":inverted" : "",
                       ", with more rows if no photo shows the whole board");
  }
  const bool squares = given.kind == Board::Kind::kChessboard &&
                       SameSides({other.columns + 1, other.rows + 1}, {given.columns, given.rows});
  return fmt::format("give chessboard:{}x{}:SQUARE{}", other.columns, other.rows,
                     squares ? " (you gave the number of squares)" : "");
}

}  // namespace

BoardCheck CheckBoard(const Grid<std::uint8_t>& grey, const Board& given) {
  if (given.kind == Board::Kind::kChessboard) {
    const BoardCheck check = CheckChessboard(grey, given);
    return SaysNothing(check) ? CheckAnyMarkers(grey, given) : check;
  }
  BoardCheck check = CheckMarkers(grey, given, given.dictionary, given.inverted);
  if (SaysNothing(check)) check = CheckAnyMarkers(grey, given);
  return SaysNothing(check) ? CheckChessboard(grey, given) : check;
}

std::string DescribeOtherBoard(const Board& given, std::span<const BoardCheck> checks) {
  std::vector<BoardCheck> others;
  for (const BoardCheck& check : checks) {
    if (check.shows_given) return "";
    if (check.other.columns > 0) others.push_back(check);
  }
  const auto votes_for = [&](const BoardCheck& one) {
    return std::count_if(others.begin(), others.end(),
                         [&](const BoardCheck& other) { return Agree(one, other); });
  };
  const auto most =
      std::max_element(others.begin(), others.end(),
                       [&](const auto& a, const auto& b) { return votes_for(a) < votes_for(b); });
  if (most == others.end()) return "";
  const auto votes = static_cast<size_t>(votes_for(*most));
  if (votes < std::min<size_t>(kMinVotes, checks.size()) || 2 * votes < others.size()) {
    return "";
  }
  Board shown = most->other;
  for (const BoardCheck& other : others) {
    if (Agree(*most, other) && other.other.rows > shown.rows) shown = other.other;
  }
  return fmt::format(
      "expected {}, as given; {} of {} photos looked at show {}, none the given one; {}",
      SizeText(given), votes, checks.size(), SizeText(shown),
      Advice(given, shown, most->first_square_white));
}

}  // namespace dtr::calib
