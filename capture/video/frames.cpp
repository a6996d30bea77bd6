#include "capture/video/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>

#include "dtr/base/error.h"

namespace dtr::capture {
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

// FFmpeg writes about damaged frames on standard error as it goes; we say once what is missing.
void QuietFfmpeg() {
  static std::once_flag once;
  std::call_once(once, [] { setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0); });
}

}  // namespace

struct VideoReader::Decoder {
  cv::VideoCapture video;
  cv::Mat frame;
};

bool IsVideoExtension(const std::string& extension) {
  std::string lower = extension;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static constexpr std::array<const char*, 6> kVideos{".mp4", ".mov", ".avi",
                                                      ".mkv", ".m4v", ".webm"};
  return std::find(kVideos.begin(), kVideos.end(), lower) != kVideos.end();
}

VideoReader::VideoReader(const std::filesystem::path& file)
    : file_(file), decoder_(std::make_unique<Decoder>()) {
  QuietFfmpeg();
  decoder_->video.open(file.string(), cv::CAP_FFMPEG);
  if (!decoder_->video.isOpened()) {
    throw Error(fmt::format(
        "{}: expected a video, found {}", file.string(),
        std::filesystem::exists(file) ? "something FFmpeg does not read" : "no such file"));
  }
}

VideoReader::~VideoReader() = default;

bool VideoReader::Next() {
  if (!decoder_->video.read(decoder_->frame)) return false;
  ++number_;
  time_s_ = decoder_->video.get(cv::CAP_PROP_POS_MSEC) / 1000;
  return true;
}

ImageRgb8 VideoReader::Picture() const {
  const cv::Mat& frame = decoder_->frame;
  if (frame.empty() || frame.type() != CV_8UC3) {
    throw Error(fmt::format("{}: frame {}: expected 8-bit colours, found others; convert the video",
                            file_.string(), number_));
  }
  return FromBgr(frame);
}

int VideoReader::frames_promised() const {
  constexpr double kMost = 1e9;  // broken headers promise anything
  const double count = decoder_->video.get(cv::CAP_PROP_FRAME_COUNT);
  return count > 0 && count < kMost ? static_cast<int>(count) : 0;
}

double VideoReader::frames_per_second() const {
  const double rate = decoder_->video.get(cv::CAP_PROP_FPS);
  return std::isfinite(rate) && rate > 0 ? rate : 0;
}

void ForEachFrame(const std::filesystem::path& file,
                  const std::function<bool(int, const ImageRgb8&)>& take) {
  VideoReader video(file);
  while (video.Next()) {
    if (!take(video.number(), video.Picture())) return;
  }
  if (video.number() < 0) {
    throw Error(fmt::format("{}: expected frames, found none; is the video whole?", file.string()));
  }
}

}  // namespace dtr::capture
