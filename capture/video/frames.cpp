#include "capture/video/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "capture/video/frame_colours.h"
#include "capture/video/video_decoder.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"

namespace dtr::capture {
namespace {

constexpr double kSomeFrames = 2;  // that a duration counts more than are shown

// Orientation 5 and above exchange width and height.
bool SameSize(const FrameKind& a, int orientation_a, const FrameKind& b, int orientation_b) {
  const bool exchanged = (orientation_a >= 5) != (orientation_b >= 5);
  return b.out_width == (exchanged ? a.out_height : a.out_width) &&
         b.out_height == (exchanged ? a.out_width : a.out_height);
}

}  // namespace

struct VideoReader::Parts {
  explicit Parts(const std::filesystem::path& file) : decoder(file) {}

  VideoDecoder decoder;
  const AVFrame* frame = nullptr;
  int orientation = 1;
  std::optional<FrameKind> first;
  int first_orientation = 1;
  FrameKind kind;
  std::optional<FrameConverter> converter;  // made for the first frame whose pixels are wanted
};

bool IsVideoExtension(const std::string& extension) {
  std::string lower = extension;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static constexpr std::array<const char*, 6> kVideos{".mp4", ".mov", ".avi",
                                                      ".mkv", ".m4v", ".webm"};
  return std::find(kVideos.begin(), kVideos.end(), lower) != kVideos.end();
}

VideoReader::VideoReader(const std::filesystem::path& file)
    : file_(file), parts_(std::make_unique<Parts>(file)) {
  const VideoDecoder& decoder = parts_->decoder;
  if (decoder.NeedsDolbyVision()) {
    throw Error(fmt::format(
        "{}: Dolby Vision profile 5: its colours cannot be read without Dolby's metadata; export "
        "the video as HDR10, HLG or SDR",
        file.string()));
  }
  if (decoder.video_tracks() > 1) {
    Remark(fmt::format("it holds {} video tracks; one of them is used", decoder.video_tracks()));
  }
}

VideoReader::~VideoReader() = default;

void VideoReader::Remark(const std::string& line) {
  if (std::find(remarks_.begin(), remarks_.end(), line) == remarks_.end()) remarks_.push_back(line);
}

bool VideoReader::Next() {
  Parts& parts = *parts_;
  if (!why_ended_.empty()) return false;
  try {
    parts.frame = parts.decoder.Next();
  } catch (const std::runtime_error& error) {
    throw Error(fmt::format("{}: frame {}: cannot be deinterlaced: {}", file_.string(), number_ + 1,
                            error.what()));
  }
  if (parts.frame == nullptr) return false;
  parts.kind = KindOf(*parts.frame, parts.decoder.SampleAspect(*parts.frame));
  const std::string why_not = WhyNotConverted(parts.kind);
  if (!why_not.empty()) {
    throw Error(fmt::format("{}: frame {}: {} is not supported; convert the video", file_.string(),
                            number_ + 1, why_not));
  }
  const auto matrix = parts.decoder.MatrixOf(*parts.frame);
  const auto orientation = matrix ? ExifOrientationOf(*matrix) : 1;
  if (!orientation) {
    Remark("its display matrix rotates by no multiple of 90 degrees: frames are taken as stored");
  }
  parts.orientation = orientation.value_or(1);
  if (!parts.first) {
    parts.first = parts.kind;
    parts.first_orientation = parts.orientation;
  } else if (!SameSize(*parts.first, parts.first_orientation, parts.kind, parts.orientation)) {
    why_ended_ = fmt::format(
        "frames from {} on: they are {}x{} as stored, those before {}x{}; cut the video there and "
        "give the rest as another one",
        number_ + 1, parts.kind.width, parts.kind.height, parts.first->width, parts.first->height);
    parts.frame = nullptr;
    return false;
  }
  for (const std::string& remark : RemarksOn(*parts.frame, parts.kind)) Remark(remark);
  if (parts.decoder.deinterlaced() > 0) Remark("interlaced frames are deinterlaced");
  ++number_;
  time_s_ = parts.decoder.TimeOf(*parts.frame);
  return true;
}

ImageRgb8 VideoReader::Picture() const {
  Parts& parts = *parts_;
  if (parts.frame == nullptr) throw std::logic_error("VideoReader::Picture: no frame");
  try {
    if (!parts.converter || parts.converter->kind() != parts.kind) {
      parts.converter.emplace(parts.kind);
    }
  } catch (const std::runtime_error& error) {
    throw Error(fmt::format("{}: frame {}: {}", file_.string(), number_, error.what()));
  }
  return io::ApplyExifOrientation(parts.converter->Convert(*parts.frame), parts.orientation);
}

int VideoReader::frames_promised() const {
  constexpr double kMost = 1e9;
  const VideoDecoder& decoder = parts_->decoder;
  if (decoder.frames_counted() > 0) return decoder.frames_counted();
  const double count = std::round(decoder.duration_s() * decoder.frames_per_second());
  return count > 0 && count < kMost ? static_cast<int>(count) : 0;
}

double VideoReader::frames_per_second() const { return parts_->decoder.frames_per_second(); }

std::string VideoReader::WhyIncomplete() const {
  if (!why_ended_.empty()) return why_ended_;
  const VideoDecoder& decoder = parts_->decoder;
  const int seen = number_ + 1;
  const std::string damaged =
      decoder.damaged() == 0 ? ""
                             : fmt::format("{} damaged frames are left out", decoder.damaged());
  const int counted = decoder.frames_counted();
  const auto promised_s = decoder.duration_s();
  bool cut = counted > 0 && seen < kCutShort * counted;
  if (counted == 0 && promised_s > 0 && decoder.frames_per_second() > 0) {
    // Frames need not come at one rate: what was shown is measured by its time.
    cut = time_s_ + kSomeFrames / decoder.frames_per_second() < kCutShort * promised_s;
  }
  if (!cut) return damaged;
  return fmt::format(
      "frames from {} on: the file says it has {}; it is trimmed, cut short or damaged{}", seen,
      frames_promised(), damaged.empty() ? "" : "; " + damaged);
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
