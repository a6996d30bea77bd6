#include "capture/video/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "capture/video/frame_colours.h"
#include "capture/video/video_decoder.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"

namespace dtr::capture {
namespace {

constexpr double kCutShort = 0.98;  // of what is promised; headers count a few frames too many
constexpr double kSomeFrames = 2;   // that a duration counts more than are shown

// Orientation 5 and above exchange width and height.
bool SameSize(const FrameKind& a, int orientation_a, const FrameKind& b, int orientation_b) {
  const bool exchanged = (orientation_a >= 5) != (orientation_b >= 5);
  return b.out_width == (exchanged ? a.out_height : a.out_width) &&
         b.out_height == (exchanged ? a.out_width : a.out_height);
}

}  // namespace

struct VideoReader::Parts {
  Parts(const std::filesystem::path& file, double memory_gb) : decoder(file, memory_gb) {}

  VideoDecoder decoder;
  const AVFrame* frame = nullptr;
  int orientation = 1;
  std::optional<FrameKind> first;
  int first_orientation = 1;
  FrameKind kind;
  std::optional<FrameConverter> converter;  // made for the first frame whose pixels are wanted
};

VideoReader::VideoReader(const std::filesystem::path& file, double memory_gb)
    : file_(file), parts_(std::make_unique<Parts>(file, memory_gb)) {
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
  const int number = parts.decoder.number();
  parts.kind = KindOf(*parts.frame, parts.decoder.SampleAspect(*parts.frame));
  const std::string why_not = WhyNotConverted(parts.kind);
  if (!why_not.empty()) {
    throw Error(fmt::format("{}: frame {}: {} is not supported; convert the video", file_.string(),
                            number, why_not));
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
        number, parts.kind.width, parts.kind.height, parts.first->width, parts.first->height);
    parts.frame = nullptr;
    return false;
  }
  for (const std::string& remark : RemarksOn(*parts.frame, parts.kind)) Remark(remark);
  if (parts.decoder.deinterlaced() > 0) Remark("interlaced frames are deinterlaced");
  number_ = number;
  const double rate = frames_per_second();
  time_s_ = parts.decoder.TimeOf(*parts.frame).value_or(rate > 0 ? number / rate : 0);
  return true;
}

ImageRgb8 VideoReader::Picture() const {
  Parts& parts = *parts_;
  if (parts.frame == nullptr) throw std::logic_error("VideoReader::Image: no frame");
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
  constexpr double kMax = 1e9;
  const VideoDecoder& decoder = parts_->decoder;
  if (decoder.frames_counted() > 0) return decoder.frames_counted();
  const double count = std::round(decoder.duration_s() * decoder.frames_per_second());
  return count > 0 && count < kMax ? static_cast<int>(count) : 0;
}

bool VideoReader::PromisesMoreThan(int frames) const {
  return frames < kCutShort * frames_promised();
}

int VideoReader::frames_so_far() const { return parts_->decoder.count(); }

std::string VideoReader::Projection() const { return parts_->decoder.Projection(); }

double VideoReader::frames_per_second() const { return parts_->decoder.frames_per_second(); }

std::string VideoReader::WhyIncomplete() const {
  if (!why_ended_.empty()) return why_ended_;
  const VideoDecoder& decoder = parts_->decoder;
  const int seen = frames_so_far();
  std::string damaged;
  if (decoder.damaged() == 1) damaged = "1 damaged frame is left out";
  if (decoder.damaged() > 1) {
    damaged = fmt::format("{} damaged frames are left out", decoder.damaged());
  }
  const bool counted = decoder.frames_counted() > 0;
  const auto promised_s = decoder.duration_s();
  bool cut = counted && PromisesMoreThan(seen);
  if (!counted && promised_s > 0 && decoder.frames_per_second() > 0) {
    // Frames need not come at one rate: what was shown is measured by its time.
    const double more = kSomeFrames + decoder.lost_behind();
    cut = time_s_ + more / decoder.frames_per_second() < kCutShort * promised_s;
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
