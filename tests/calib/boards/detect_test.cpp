#include "calib/boards/detect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/boards/repeats.h"
#include "dtr/base/error.h"
#include "tests/calib/boards/rendered_board.h"

namespace dtr::calib {
namespace {

using testing::Photo;

const PinholeCamera kCamera(640, 480, 600, 600, 320, 240);
const Board kChessboard{Board::Kind::kChessboard, 7, 5, 0.03, 0, "", false};
const Board kCharuco{Board::Kind::kCharuco, 4, 5, 0.04, 0.7, "DICT_4X4_50", false};
// OpenCV's refinement errs by about 0.03 px per coordinate on photos without any noise, depending
// on where the pixel grid lies. Its mean over a board is what conventions would show in.
constexpr double kExactPhotoPx = 0.06, kMeanPx = 0.015;

Pose Tilted(const Board& board, double tilt, double distance) {
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.6, 0.8, 0)) *
                  Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d middle = 0.5 * (board.Corner(0) + board.Corner(board.CornerCount() - 1));
  pose.translation = Eigen::Vector3d(0.01, -0.005, distance) - pose.rotation * middle;
  return pose;
}

struct DetectionError {
  double rms_px = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
};

DetectionError ErrorOf(const Board& board, const Pose& pose, const Detection& found) {
  DetectionError error;
  const auto count = static_cast<double>(found.corners.size());
  for (const BoardCorner& corner : found.corners) {
    const Eigen::Vector2d off =
        corner.pixel - *kCamera.PixelFromCam(pose * board.Corner(corner.id));
    error.rms_px += off.squaredNorm() / count;
    error.mean_px += off / count;
  }
  error.rms_px = std::sqrt(error.rms_px);
  return error;
}

TEST(BoardText, ReadsWhatItSays) {
  const Board board = BoardFromText("chessboard:9x6:25mm");
  EXPECT_EQ(board.columns, 9);
  EXPECT_EQ(board.rows, 6);
  EXPECT_DOUBLE_EQ(board.square, 0.025);
  EXPECT_EQ(board.Corner(10), Eigen::Vector3d(0.025, 0.025, 0));
  const Board charuco = BoardFromText("charuco:4x5:5.4cm:0.75:DICT_4X4_1000:inverted");
  EXPECT_EQ(charuco.columns, 3);  // inner corners
  EXPECT_EQ(charuco.rows, 4);
  EXPECT_DOUBLE_EQ(charuco.marker_share, 0.75);
  EXPECT_TRUE(charuco.inverted);
  EXPECT_DOUBLE_EQ(BoardFromText("charuco:4x5:40mm:30mm").marker_share, 0.75);
  EXPECT_EQ(BoardFromText(TextOf(charuco)), charuco);
  EXPECT_EQ(BoardFromText(TextOf(board)), board);
}

TEST(BoardText, RejectsWhatIsNoBoard) {
  for (const char* text :
       {"", "chessboard", "chessboard:9x6", "chessboard:9:1", "chessboard:1x6:1",
        "chessboard:9x6:0", "chessboard:9x6:-1", "chessboard:9x6:1km", "chessboard:9x6:1:2",
        "chessboard:9x6:nan", "chessboard:99999x6:1", "circles:9x6:1", "charuco:4x5:1",
        "charuco:4x5:1:1.5", "charuco:4x5:1:0.7:DICT_9X9",
        "charuco:4x5:1:0.7:DICT_4X4_50:upside-down", "charuco:4x5:30:22mm", "chessboard:2x6:1",
        "charuco:-2147483648x5:1:0.5"}) {
    EXPECT_THROW(BoardFromText(text), UsageError) << text;
  }
}

TEST(DetectBoard, ChessboardCornersAreWhereTheyAreByBothDetectors) {
  const Pose pose = Tilted(kChessboard, 0.4, 0.4);
  const auto grey = Photo(kChessboard, kCamera, pose, 0, 1);
  for (const auto detector : {ChessboardDetector::kQuads, ChessboardDetector::kSectors}) {
    DetectOptions options;
    options.detector = detector;
    const Detection found = DetectBoard(grey, kChessboard, options);
    ASSERT_EQ(found.corners.size(), 35u) << found.reason;
    // The sector detector may begin at the other end of the board: the same corners, turned.
    const Pose turned{pose.rotation * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()),
                      pose * (kChessboard.Corner(0) + kChessboard.Corner(34))};
    const DetectionError one = ErrorOf(kChessboard, pose, found);
    const DetectionError other = ErrorOf(kChessboard, turned, found);
    const DetectionError& error = one.rms_px < other.rms_px ? one : other;
    EXPECT_LT(error.rms_px, kExactPhotoPx);
    EXPECT_LT(error.mean_px.norm(), kMeanPx);
  }
}

TEST(DetectBoard, CharucoCornersAreWhereTheyAreWholePartlyAndInverted) {
  for (const bool inverted : {false, true}) {
    Board board = kCharuco;
    board.inverted = inverted;
    for (const double aside : {0.0, 0.15}) {  // partly out of the image
      Pose pose = Tilted(kCharuco, 0.4, 0.45);
      pose.translation.x() += aside;
      const auto grey = Photo(board, kCamera, pose, 0, 1);
      const Grid<std::uint8_t> before = grey;
      const Detection found = DetectBoard(grey, board);
      EXPECT_TRUE(std::equal(grey.data().begin(), grey.data().end(), before.data().begin()));
      ASSERT_GE(found.corners.size(), 4u) << found.reason;
      EXPECT_EQ(found.corners.size() == 20u, aside == 0);
      EXPECT_LT(ErrorOf(board, pose, found).rms_px, kExactPhotoPx);
    }
  }
}

TEST(CharucoPrint, BeginsWithABlackSquareAndTheFirstMarkerBesideItWithAnyVersionOfOpenCv) {
  for (const int rows : {5, 6}) {  // of squares
    const Board board{Board::Kind::kCharuco, 4, rows - 1, 0.04, 0.7, "DICT_4X4_50", false};
    const testing::BoardPrint print(board);
    EXPECT_EQ(print.Brightness({0.05, 0.05}), 0) << rows << " rows";
    EXPECT_EQ(print.Brightness({1.05, 0.05}), 1) << rows << " rows";  // paper around the marker
    EXPECT_EQ(print.Brightness({1.2, 0.2}), 0) << rows << " rows";    // its frame
    EXPECT_EQ(print.Brightness({0.05, 1.05}), 1) << rows << " rows";
  }
}

TEST(DetectBoard, SaysWhyNothingWasFound) {
  const Grid<std::uint8_t> grey(640, 480, 1, 128);
  EXPECT_THAT(DetectBoard(grey, kChessboard).reason,
              ::testing::HasSubstr("expected the whole board, 7 x 5 inner corners"));
  EXPECT_THAT(DetectBoard(grey, kCharuco).reason, ::testing::HasSubstr("at least 4 corners"));
  Board inverted = kCharuco;
  inverted.inverted = true;
  const auto upright = Photo(kCharuco, kCamera, Tilted(kCharuco, 0.4, 0.45), 0, 1);
  EXPECT_TRUE(DetectBoard(upright, inverted).corners.empty());
}

TEST(CornerNoise, TellsTheScatterThatNoiseInTheImageMakes) {
  const Pose pose = Tilted(kChessboard, 0.3, 0.4);
  for (const double levels : {3.0, 10.0}) {
    double told = 0, scatter = 0;
    constexpr int kPhotos = 4;
    const Detection exact = DetectBoard(Photo(kChessboard, kCamera, pose, 0, 1), kChessboard);
    for (int i = 0; i < kPhotos; ++i) {
      const auto grey = Photo(kChessboard, kCamera, pose, levels, 10 + i);
      const Detection found = DetectBoard(grey, kChessboard);
      ASSERT_EQ(found.corners.size(), 35u);
      told += found.noise_px / kPhotos;
      for (size_t c = 0; c < 35; ++c) {
        scatter += (found.corners[c].pixel - exact.corners[c].pixel).squaredNorm();
      }
    }
    const double sigma = std::sqrt(scatter / (2 * 35 * kPhotos));
    std::printf("noise of %.0f levels: corners scatter by %.4f px, told %.4f px\n", levels, sigma,
                told);
    EXPECT_GT(told, 0.7 * sigma);
    EXPECT_LT(told, 1.4 * sigma);
  }
}

TEST(TakeOutRepeats, LeavesOutWhatAddsNothingAndNamesWhatItRepeats) {
  BoardView first{"a", {{0, {10, 10}}, {1, {20, 10}}, {2, {30, 10}}}, 0};
  BoardView near{"b", {{0, {10.5, 10}}, {1, {20, 10.5}}}, 0};  // less of the same
  BoardView more{"c", {{0, {10, 10}}, {3, {20, 20}}}, 0};      // a corner that a does not see
  BoardView far{"d", {{0, {15, 10}}, {1, {25, 10}}}, 0};
  std::vector<BoardView> views{first, near, more, far};
  const auto left_out = TakeOutRepeats(1.6, views);
  ASSERT_EQ(left_out.size(), 1u);
  EXPECT_EQ(left_out[0].name, "b");
  EXPECT_THAT(left_out[0].reason, ::testing::HasSubstr("where a shows it"));
  EXPECT_EQ(views.size(), 3u);
}

}  // namespace
}  // namespace dtr::calib
