#include "cli/pipeline/video_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

ImageRgb8 FromBgr(const cv::Mat& frame) {
  ImageRgb8 image(frame.cols, frame.rows, 3);
  for (int y = 0; y < frame.rows; ++y) {
    const auto* from = frame.ptr<std::uint8_t>(y);
    std::uint8_t* to = image.row(y);
    for (int x = 0; x < 3 * frame.cols; x += 3) {
      to[x] = from[x + 2];
      to[x + 1] = from[x + 1];
      to[x + 2] = from[x];
    }
  }
  return image;
}

}  // namespace

bool IsVideoExtension(const std::string& extension) {
  std::string lower = extension;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static constexpr std::array<const char*, 6> kVideos{".mp4", ".mov", ".avi",
                                                      ".mkv", ".m4v", ".webm"};
  return std::find(kVideos.begin(), kVideos.end(), lower) != kVideos.end();
}

void ForEachFrame(const std::filesystem::path& file,
                  const std::function<bool(int, const ImageRgb8&)>& take) {
  cv::VideoCapture video;
  video.open(file.string(), cv::CAP_FFMPEG);
  if (!video.isOpened()) {
    throw Error(
        fmt::format("{}: expected a video, found something FFmpeg does not read", file.string()));
  }
  cv::Mat frame;
  int number = 0;
  while (video.read(frame)) {
    if (frame.empty() || frame.type() != CV_8UC3) {
      throw Error(fmt::format("{}: frame {}: expected 8-bit colour", file.string(), number));
    }
    if (!take(number++, FromBgr(frame))) return;
  }
  if (number == 0) throw Error(fmt::format("{}: expected frames, found none", file.string()));
}

}  // namespace dtr::pipeline
