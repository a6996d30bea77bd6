#include "capture/video/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string_view>

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

// FFmpeg would follow a playlist to files and hosts that it names, whatever the file is called:
// only what begins as one of these is given to it.
bool BeginsAsVideo(const std::filesystem::path& file) {
  std::array<char, 12> bytes{};
  std::ifstream(file, std::ios::binary).read(bytes.data(), bytes.size());
  const std::string_view begin(bytes.data(), bytes.size());
  static constexpr std::array<std::string_view, 9> kBoxes{
      // of MP4 and QuickTime
      "ftyp", "moov", "mdat", "free", "skip", "wide", "pnot", "styp", "uuid"};
  static constexpr std::array<std::string_view, 6> kStarts{"\x1a\x45\xdf\xa3",
                                                           "FLV",
                                                           "OggS",
                                                           "\x30\x26\xb2\x75",
                                                           "G@",  // Matroska, ..., ASF, MPEG-TS
                                                           std::string_view("\0\0\1\xba", 4)};
  if (begin.starts_with("RIFF") && begin.substr(8) == "AVI ") return true;
  return std::any_of(kBoxes.begin(), kBoxes.end(),
                     [&](std::string_view box) { return begin.substr(4, 4) == box; }) ||
         std::any_of(kStarts.begin(), kStarts.end(),
                     [&](std::string_view start) { return begin.starts_with(start); });
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
  if (!std::filesystem::exists(file)) {
    throw Error(fmt::format("{}: expected a video, found no such file", file.string()));
  }
  if (!BeginsAsVideo(file)) {
    throw Error(
        fmt::format("{}: expected a video, found something else by its first bytes; "
                    "playlists are not followed, give the video itself",
                    file.string()));
  }
  // What stands before a colon at the beginning would be a protocol.
  decoder_->video.open(std::filesystem::absolute(file).string(), cv::CAP_FFMPEG);
  if (!decoder_->video.isOpened()) {
    throw Error(
        fmt::format("{}: expected a video, found something FFmpeg does not read", file.string()));
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
