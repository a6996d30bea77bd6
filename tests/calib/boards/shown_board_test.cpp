#include "calib/boards/shown_board.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "calib/boards/detect.h"
#include "tests/calib/boards/rendered_board.h"

namespace dtr::calib {
namespace {

using testing::Photo;

const PinholeCamera kCamera(640, 480, 600, 600, 320, 240);

Board Chessboard(int columns, int rows) {
  return {Board::Kind::kChessboard, columns, rows, 0.03, 0, "", false};
}

Grid<std::uint8_t> PhotoOf(const Board& board, double tilt, double about, double distance) {
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.6, 0.8, 0)) *
                  Eigen::AngleAxisd(about, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d middle = 0.5 * (board.Corner(0) + board.Corner(board.CornerCount() - 1));
  pose.translation = Eigen::Vector3d(0, 0, distance) - pose.rotation * middle;
  return Photo(board, kCamera, pose, 2, 1);
}

// Sides in either order: a photo does not say which is across.
std::pair<int, int> Sides(const GridSize& size) { return std::minmax(size.columns, size.rows); }

TEST(ShownBoard, ASizeIsFoundWithoutBeingGiven) {
  for (const auto& [columns, rows] : {std::pair(9, 6), std::pair(8, 5), std::pair(12, 12)}) {
    for (const double tilt : {0.0, 0.4}) {
      const auto shown = FindChessboard(PhotoOf(Chessboard(columns, rows), tilt, 0.2, 0.8));
      ASSERT_TRUE(shown.has_value());
      EXPECT_EQ(Sides(shown->size), Sides({columns, rows}));
    }
  }
}

TEST(ShownBoard, APhotoWithoutABoardShowsNone) {
  const Grid<std::uint8_t> grey(320, 240, 1, 128);
  EXPECT_FALSE(FindChessboard(grey).has_value());
  EXPECT_FALSE(MarkersShown(grey, false).has_value());
}

TEST(ShownBoard, MarkersAreOfTheDictionaryAndTheBoardThatWerePrinted) {
  struct Case {
    const char* printed;
    int columns, rows;  // squares
    const char* reported;
  };
  for (const Case& c :
       {Case{"DICT_5X5_100", 5, 6, "DICT_5X5_50"}, Case{"DICT_6X6_250", 7, 5, "DICT_6X6_50"},
        Case{"DICT_4X4_50", 6, 8, "DICT_4X4_50"}}) {
    const Board board{
        Board::Kind::kCharuco, c.columns - 1, c.rows - 1, 0.04, 0.7, c.printed, false};
    for (const std::string& given : {std::string(), std::string(c.printed)}) {
      const auto shown = MarkersShown(PhotoOf(board, 0.2, 0.1, 0.5), false, given);
      ASSERT_TRUE(shown.has_value());
      EXPECT_EQ(shown->dictionary, c.reported);
      EXPECT_EQ(shown->largest_id, c.columns * c.rows / 2 - 1);
      EXPECT_EQ(shown->columns, c.columns);
      EXPECT_EQ(shown->rows, c.rows);
      EXPECT_FALSE(shown->first_square_white);
    }
  }
}

TEST(ShownBoard, AnInvertedBoardIsSeenInvertedOnlyAndThePhotoIsLeftAsItIs) {
  const Board board{Board::Kind::kCharuco, 3, 4, 0.04, 0.7, "DICT_4X4_50", true};
  const auto grey = PhotoOf(board, 0.2, 0.1, 0.5);
  const Grid<std::uint8_t> before = grey;
  const auto inverted = MarkersShown(grey, true);
  ASSERT_TRUE(inverted.has_value());
  EXPECT_EQ(inverted->columns, 4);
  const auto plain = MarkersShown(grey, false);
  EXPECT_TRUE(!plain || plain->columns == 0);
  EXPECT_TRUE(std::equal(grey.data().begin(), grey.data().end(), before.data().begin()));
}

TEST(ShownBoard, AFamilyIsADictionaryWithoutItsSize) {
  EXPECT_EQ(FamilyOf("DICT_4X4_1000"), "DICT_4X4");
  EXPECT_EQ(FamilyOf("DICT_ARUCO_ORIGINAL"), "DICT_ARUCO_ORIGINAL");
  EXPECT_EQ(FamilyOf("DICT_APRILTAG_36h11"), "DICT_APRILTAG_36h11");
}

TEST(ShownBoard, SidesInTheOtherOrderAreTheSameBoardSeenFromItsFace) {
  const Board shown = Chessboard(9, 6), given = Chessboard(6, 9);
  for (const double about : {0.1, 1.5, 3.0}) {
    const Detection found = DetectBoard(PhotoOf(shown, 0.3, about, 0.7), given);
    ASSERT_EQ(found.corners.size(), 54u);
    const Eigen::Vector2d across = found.corners[1].pixel - found.corners[0].pixel;
    const Eigen::Vector2d along = found.corners[6].pixel - found.corners[0].pixel;
    EXPECT_GT(across.x() * along.y() - across.y() * along.x(), 0);
    EXPECT_NEAR(across.norm() / along.norm(), 1, 0.3);
  }
}

}  // namespace
}  // namespace dtr::calib
