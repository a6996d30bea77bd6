#include "calib/boards/board_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/calib/boards/rendered_board.h"

namespace dtr::calib {
namespace {

using ::testing::HasSubstr;
using testing::Photo;

const PinholeCamera kCamera(640, 480, 600, 600, 320, 240);

Board Chessboard(int columns, int rows) {
  return {Board::Kind::kChessboard, columns, rows, 0.03, 0, "", false};
}

Board Charuco(int columns, int rows, const std::string& dictionary, bool inverted = false) {
  return {Board::Kind::kCharuco, columns - 1, rows - 1, 0.04, 0.7, dictionary, inverted};
}

// What photos of one board say of another one that was given.
std::string Said(const Board& shown, const Board& given,
                 const std::vector<double>& tilts = {0, 0.3, -0.4}) {
  std::vector<BoardCheck> checks;
  for (const double tilt : tilts) {
    Pose pose;
    pose.rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.6, 0.8, 0)) *
                    Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d middle = 0.5 * (shown.Corner(0) + shown.Corner(shown.CornerCount() - 1));
    pose.translation = Eigen::Vector3d(0, 0, 0.8) - pose.rotation * middle;
    checks.push_back(CheckBoard(Photo(shown, kCamera, pose, 2, 1), given));
  }
  return DescribeOtherBoard(given, checks);
}

TEST(BoardCheck, TheGivenBoardPasses) {
  for (const Board& board : {Chessboard(9, 6), Chessboard(6, 9), Chessboard(7, 7),
                             Charuco(5, 6, "DICT_5X5_100"), Charuco(4, 5, "DICT_4X4_50", true)}) {
    EXPECT_EQ(Said(board, board), "");
  }
  EXPECT_EQ(Said(Chessboard(9, 6), Chessboard(6, 9)), "");  // the same board
}

TEST(BoardCheck, ALargerOrSmallerChessboardIsNamed) {
  EXPECT_THAT(Said(Chessboard(12, 12), Chessboard(9, 6)),
              HasSubstr("3 of 3 photos looked at show a chessboard of 12x12 inner corners"));
  // One photo: OpenCV takes eight seconds to find that a board of another size is not there.
  EXPECT_THAT(Said(Chessboard(9, 6), Chessboard(7, 5), {0.3}),
              HasSubstr("give chessboard:9x6:SQUARE"));
  EXPECT_THAT(Said(Chessboard(9, 6), Chessboard(5, 11), {0.3}),
              HasSubstr("give chessboard:6x9:SQUARE"));
}

TEST(BoardCheck, ANumberOfSquaresIsRecognisedAsSuch) {
  EXPECT_THAT(Said(Chessboard(9, 6), Chessboard(10, 7), {0.3}),
              HasSubstr("give chessboard:9x6:SQUARE (you gave the number of squares)"));
}

TEST(BoardCheck, AnotherCharucoBoardIsNamedWithItsDictionary) {
  EXPECT_THAT(Said(Charuco(6, 8, "DICT_4X4_50"), Charuco(5, 8, "DICT_4X4_50")),
              HasSubstr("give charuco:6x8:SQUARE:MARKER:DICT_4X4_50"));
  EXPECT_THAT(Said(Charuco(5, 6, "DICT_5X5_100"), Charuco(5, 6, "DICT_4X4_50")),
              HasSubstr("give charuco:5x6:SQUARE:MARKER:DICT_5X5_50"));
  EXPECT_THAT(Said(Charuco(4, 5, "DICT_4X4_50", true), Charuco(4, 5, "DICT_4X4_50")),
              HasSubstr("give charuco:4x5:SQUARE:MARKER:DICT_4X4_50:inverted"));
}

TEST(BoardCheck, TheOtherKindOfBoardIsNamed) {
  EXPECT_THAT(Said(Chessboard(9, 6), Charuco(5, 6, "DICT_5X5_100")),
              HasSubstr("give chessboard:9x6:SQUARE"));
  EXPECT_THAT(Said(Charuco(5, 6, "DICT_5X5_100"), Chessboard(9, 6)),
              HasSubstr("give charuco:5x6:SQUARE:MARKER:DICT_5X5_50"));
}

// A poster of a board on the wall.
TEST(BoardCheck, ALargerBoardBehindTheGivenOneIsNotTakenForIt) {
  const Board given = Chessboard(7, 5), behind = Chessboard(11, 8);
  const auto photo_of = [](const Board& board, double x, double distance) {
    Pose pose;
    const Eigen::Vector3d middle = 0.5 * (board.Corner(0) + board.Corner(board.CornerCount() - 1));
    pose.translation = Eigen::Vector3d(x, 0, distance) - middle;
    return Photo(board, kCamera, pose, 2, 1);
  };
  auto grey = photo_of(given, -0.18, 0.7);
  const auto right = photo_of(behind, 0.3, 1.1);
  for (int y = 0; y < grey.height(); ++y) {
    for (int x = 320; x < grey.width(); ++x) grey(x, y) = right(x, y);
  }
  EXPECT_TRUE(CheckBoard(grey, given).shows_given);
}

TEST(BoardCheck, PhotosThatDisagreeSayNothing) {
  const Board given = Chessboard(9, 6);
  const auto other = [](int columns, int rows) {
    BoardCheck check;
    check.other = Chessboard(columns, rows);
    return check;
  };
  BoardCheck agrees;
  agrees.shows_given = true;
  using BoardChecks = std::vector<BoardCheck>;
  EXPECT_EQ(DescribeOtherBoard(given, BoardChecks{}), "");
  EXPECT_EQ(DescribeOtherBoard(given, BoardChecks{{}, {}}), "");
  EXPECT_EQ(DescribeOtherBoard(given, BoardChecks{other(12, 12), {}}), "");
  EXPECT_EQ(DescribeOtherBoard(given, BoardChecks{other(12, 12), other(12, 12), agrees}), "");
  EXPECT_EQ(DescribeOtherBoard(given, BoardChecks{other(8, 8), other(8, 8), other(5, 4),
                                                  other(4, 4), other(3, 3)}),
            "");
  EXPECT_NE(DescribeOtherBoard(given, BoardChecks{other(12, 12)}), "");
  EXPECT_NE(DescribeOtherBoard(given, BoardChecks{other(12, 12), other(12, 12), {}, other(4, 4)}),
            "");
}

}  // namespace
}  // namespace dtr::calib
