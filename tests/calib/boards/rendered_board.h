// tests/calib/boards/rendered_board.h -- images of boards with corners known exactly.
#pragma once
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calib/boards/board.h"
#include "calib/boards/opencv_aruco.h"
#include "dtr/base/random.h"
#include "dtr/types/camera.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr::calib::testing {

/// The board's print: 1 white, 0 black, at a place of its plane in squares; paper around it.
class BoardPrint {
 public:
  explicit BoardPrint(const Board& board) : board_(board) {
    if (board.kind == Board::Kind::kChessboard) return;
    print_ = PrintOf(CharucoOf(board, MarkersOf(board.dictionary)),
                     {kTexels * (board.columns + 1), kTexels * (board.rows + 1)});
  }

  double Brightness(const Eigen::Vector2d& place) const {
    const bool charuco = board_.kind == Board::Kind::kCharuco;
    // A chessboard's frame begins at its first inner corner, a ChArUco board's at its outer one.
    const double x = place.x() + (charuco ? 0 : 1), y = place.y() + (charuco ? 0 : 1);
    if (x < 0 || y < 0 || x >= board_.columns + 1 || y >= board_.rows + 1) {
      return board_.inverted ? 0 : 1;
    }
    double white = (static_cast<int>(x) + static_cast<int>(y)) % 2 == 0 ? 0 : 1;
    if (charuco) {
      white = print_.at<std::uint8_t>(static_cast<int>(y * kTexels),
                                      static_cast<int>(x * kTexels)) > 127;
    }
    return board_.inverted ? 1 - white : white;
  }

 private:
  static constexpr int kTexels = 120;  // per square
  Board board_;
  cv::Mat print_;
};

/// A photo of the board by a camera without distortion: each pixel sees a square of 2 x 2 pixels,
/// as sharp as a good lens, by 6 x 6 samples; grey values 40 to 210, and normal noise of `noise`
/// levels.
inline Grid<std::uint8_t> Photo(const Board& board, const PinholeCamera& camera,
                                const Pose& cam_from_board, double noise, std::uint64_t seed) {
  constexpr int kSamples = 6;
  constexpr double kBlurPx = 2;
  const BoardPrint print(board);
  Random random(seed);
  Eigen::Matrix3d ray_from_place;  // of the plane z = 0
  ray_from_place << cam_from_board.rotation * Eigen::Vector3d::UnitX() * board.square,
      cam_from_board.rotation * Eigen::Vector3d::UnitY() * board.square, cam_from_board.translation;
  const Eigen::Matrix3d place_from_ray = ray_from_place.inverse();
  Grid<std::uint8_t> grey(camera.width_px(), camera.height_px());
  for (int y = 0; y < grey.height(); ++y) {
    for (int x = 0; x < grey.width(); ++x) {
      double sum = 0;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const double across = (k % kSamples + 0.5) / kSamples - 0.5;
        const double down = (k / kSamples + 0.5) / kSamples - 0.5;
        const Eigen::Vector2d pixel(x + 0.5 + kBlurPx * across, y + 0.5 + kBlurPx * down);
        sum += print.Brightness((place_from_ray * camera.RayFromPixel(pixel)).hnormalized());
      }
      const double level =
          40 + 170 * sum / (kSamples * kSamples) + (noise > 0 ? noise * random.Normal() : 0);
      grey(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
  }
  return grey;
}

}  // namespace dtr::calib::testing
