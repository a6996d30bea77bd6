#include "calib/boards/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>

#include "calib/boards/length.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

constexpr int kMaxCornersPerSide = 1000;

// In the order of OpenCV's PREDEFINED_DICTIONARY_NAME.
constexpr const char* kDictionaries[] = {
    "DICT_4X4_50",         "DICT_4X4_100",       "DICT_4X4_250",       "DICT_4X4_1000",
    "DICT_5X5_50",         "DICT_5X5_100",       "DICT_5X5_250",       "DICT_5X5_1000",
    "DICT_6X6_50",         "DICT_6X6_100",       "DICT_6X6_250",       "DICT_6X6_1000",
    "DICT_7X7_50",         "DICT_7X7_100",       "DICT_7X7_250",       "DICT_7X7_1000",
    "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h10",
    "DICT_APRILTAG_36h11"};

[[noreturn]] void RejectText(const std::string& text, const std::string& what) {
  throw UsageError(
      fmt::format("--board {}: {}; expected chessboard:WxH:SQUARE (W x H inner corners) or "
                  "charuco:WxH:SQUARE:MARKER[:DICTIONARY][:inverted] (W x H squares)",
                  text, what));
}

std::vector<std::string> Split(const std::string& text) {
  std::vector<std::string> parts{""};
  for (const char c : text) {
    if (c == ':') {
      parts.emplace_back();
    } else {
      parts.back().push_back(c);
    }
  }
  return parts;
}

bool SizeFrom(std::string_view word, int* width, int* height) {
  const char* last = word.data() + word.size();
  const auto first = std::from_chars(word.data(), last, *width);
  if (first.ec != std::errc() || first.ptr == last || *first.ptr != 'x') return false;
  const auto second = std::from_chars(first.ptr + 1, last, *height);
  return second.ec == std::errc() && second.ptr == last;
}

}  // namespace

std::optional<Length> LengthFrom(std::string_view word) {
  Length length;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), length.value);
  if (failure != std::errc() || !(length.value > 0) || !std::isfinite(length.value)) return {};
  const std::string_view unit(end, static_cast<size_t>(word.data() + word.size() - end));
  length.has_unit = !unit.empty();
  if (unit == "mm") length.value /= 1000;
  if (unit == "cm") length.value /= 100;
  if (unit != "" && unit != "mm" && unit != "cm" && unit != "m") return {};
  return length;
}

Eigen::Vector3d Board::Corner(int id) const {
  const double first = kind == Kind::kCharuco ? 1 : 0;
  return {(id % columns + first) * square, (id / columns + first) * square, 0};
}

int DictionaryNumber(const std::string& name) {
  for (int i = 0; i < static_cast<int>(std::size(kDictionaries)); ++i) {
    if (name == kDictionaries[i]) return i;
  }
  return -1;
}

void CheckBoard(const Board& board, const std::string& where) {
  // OpenCV finds no chessboard with fewer than 3.
  const int least = board.kind == Board::Kind::kChessboard ? 3 : 2;
  for (const int side : {board.columns, board.rows}) {
    if (side < least || side > kMaxCornersPerSide) {
      throw Error(fmt::format("{}: expected {} to {} inner corners per side, found {} x {}", where,
                              least, kMaxCornersPerSide, board.columns, board.rows));
    }
  }
  if (!(board.square > 0) || !std::isfinite(board.square)) {
    throw Error(
        fmt::format("{}: expected a positive side of a square, found {}", where, board.square));
  }
  if (board.kind == Board::Kind::kChessboard) return;
  if (!(board.marker_share > 0 && board.marker_share < 1)) {
    throw Error(fmt::format("{}: expected markers smaller than their squares, found a share of {}",
                            where, board.marker_share));
  }
  if (DictionaryNumber(board.dictionary) < 0) {
    throw Error(fmt::format("{}: expected a dictionary of OpenCV, as DICT_4X4_50, found '{}'",
                            where, board.dictionary));
  }
}

Board BoardFromText(const std::string& text) {
  const std::vector<std::string> parts = Split(text);
  Board board;
  if (parts[0] == "charuco") {
    board.kind = Board::Kind::kCharuco;
    board.dictionary = "DICT_4X4_50";
  } else if (parts[0] != "chessboard") {
    RejectText(text, "unknown kind '" + parts[0] + "'");
  }
  const bool charuco = board.kind == Board::Kind::kCharuco;
  if (parts.size() < (charuco ? 4u : 3u)) RejectText(text, "too few parts");
  if (!SizeFrom(parts[1], &board.columns, &board.rows)) {
    RejectText(text, "no size in '" + parts[1] + "'");
  }
  const auto square = LengthFrom(parts[2]);
  if (!square) RejectText(text, "no length in '" + parts[2] + "'");
  board.square = square->value;
  board.metric = square->has_unit;
  size_t next = 3;
  if (charuco) {
    if (std::min(board.columns, board.rows) < 0) RejectText(text, "no size in '" + parts[1] + "'");
    board.columns -= 1;  // squares to inner corners
    board.rows -= 1;
    const auto marker = LengthFrom(parts[next++]);
    if (!marker) RejectText(text, "no marker size in '" + parts[3] + "'");
    if (marker->has_unit && !square->has_unit) {
      RejectText(text, "a marker with a unit on a square without one");
    }
    board.marker_share = marker->has_unit ? marker->value / square->value : marker->value;
    if (next < parts.size() && parts[next] != "inverted") board.dictionary = parts[next++];
    if (next < parts.size() && parts[next] == "inverted") {
      board.inverted = true;
      ++next;
    }
  }
  if (next != parts.size()) RejectText(text, "unexpected '" + parts[next] + "'");
  try {
    CheckBoard(board, "--board " + text);
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
  return board;
}

std::string TextOf(const Board& board) {
  const char* unit = board.metric ? "m" : "";
  if (board.kind == Board::Kind::kChessboard) {
    return fmt::format("chessboard:{}x{}:{}{}", board.columns, board.rows, board.square, unit);
  }
  return fmt::format("charuco:{}x{}:{}{}:{}:{}{}", board.columns + 1, board.rows + 1, board.square,
                     unit, board.marker_share, board.dictionary, board.inverted ? ":inverted" : "");
}

}  // namespace dtr::calib
