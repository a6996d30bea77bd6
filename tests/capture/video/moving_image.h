// tests/capture/video/moving_image.h -- images of a camera that moves past a wall.
#pragma once
#include <cmath>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <vector>

#include "dtr/base/random.h"
#include "dtr/types/grid.h"

namespace dtr::capture::testing {

inline constexpr int kWidth = 320, kHeight = 180;

/// Smooth blobs some 8 px wide, bilinear between lattice values: what is shifted by parts of a
/// pixel. Each wall is another one.
class Wall {
 public:
  explicit Wall(int number) : values_(kColumns, kRows) {
    Random random(static_cast<std::uint64_t>(number));
    for (double& value : values_.data()) value = 20 + 200 * random.Uniform();
  }
  double At(double x_px, int y_px) const {
    const double u = x_px / 8 + kColumns / 2, v = y_px / 8.0;
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    const double fu = u - i, fv = v - j;
    return (1 - fv) * ((1 - fu) * values_(i, j) + fu * values_(i + 1, j)) +
           fv * ((1 - fu) * values_(i, j + 1) + fu * values_(i + 1, j + 1));
  }

 private:
  static constexpr int kColumns = 600, kRows = kHeight / 8 + 2;
  Grid<double> values_;
};

inline Grid<std::uint8_t> GreyAt(double x_px, int wall = 1) {
  static const Wall kWalls[] = {Wall(1), Wall(2)};
  Grid<std::uint8_t> grey(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      grey(x, y) = static_cast<std::uint8_t>(kWalls[wall - 1].At(x + x_px, y));
    }
  }
  return grey;
}

/// A video (Motion JPEG) of the wall from these places.
inline void WriteVideo(const std::filesystem::path& file, const std::vector<double>& places_px,
                       double frames_per_second = 25) {
  cv::VideoWriter video(file.string(), cv::CAP_OPENCV_MJPEG,
                        cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), frames_per_second,
                        cv::Size(kWidth, kHeight));
  for (const double place : places_px) {
    const Grid<std::uint8_t> grey = GreyAt(place);
    cv::Mat frame(kHeight, kWidth, CV_8UC3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        frame.at<cv::Vec3b>(y, x) = cv::Vec3b::all(grey(x, y));
      }
    }
    video.write(frame);
  }
}

}  // namespace dtr::capture::testing
