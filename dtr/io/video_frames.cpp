#include "dtr/io/video_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <list>
#include <memory>
#include <mutex>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"
#include "dtr/io/ffmpeg_handles.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

// ITU-R BT.709, part 3: Y' = kRed R' + kGreen G' + kBlue B'.
constexpr double kRed = 0.2126, kBlue = 0.0722, kGreen = 1 - kRed - kBlue;
constexpr double kMiddle = 128;  // of Cb and Cr

std::uint8_t Level(double value) {
  return static_cast<std::uint8_t>(std::clamp(value + 0.5, 0.0, 255.0));
}

[[noreturn]] void FailVideo(const fs::path& file, int code) {
  throw Error(
      fmt::format("{}: FFmpeg cannot read it as a video: {}", file.string(), FfmpegError(code)));
}

/// A file's content for FFmpeg to read from: what was hashed is what is decoded, and nothing is
/// opened that the content names.
class MemoryInput {
 public:
  explicit MemoryInput(std::string bytes) : bytes_(std::move(bytes)) {
    constexpr int kBufferBytes = 1 << 15;
    context_ = avio_alloc_context(static_cast<unsigned char*>(av_malloc(kBufferBytes)),
                                  kBufferBytes, 0, this, &Read, nullptr, &Seek);
  }
  ~MemoryInput() {
    av_freep(&context_->buffer);
    avio_context_free(&context_);
  }
  MemoryInput(const MemoryInput&) = delete;
  MemoryInput& operator=(const MemoryInput&) = delete;
  AVIOContext* context() const { return context_; }
  size_t size() const { return bytes_.size(); }

 private:
  static int Read(void* opaque, std::uint8_t* to, int most) {
    auto& input = *static_cast<MemoryInput*>(opaque);
    const size_t count = std::min(static_cast<size_t>(most), input.bytes_.size() - input.at_);
    if (count == 0) return AVERROR_EOF;
    std::copy_n(input.bytes_.data() + input.at_, count, to);
    input.at_ += count;
    return static_cast<int>(count);
  }
  static std::int64_t Seek(void* opaque, std::int64_t offset, int whence) {
    auto& input = *static_cast<MemoryInput*>(opaque);
    const auto size = static_cast<std::int64_t>(input.bytes_.size());
    if ((whence & AVSEEK_SIZE) != 0) return size;
    const std::int64_t from = (whence & 3) == SEEK_CUR   ? static_cast<std::int64_t>(input.at_)
                              : (whence & 3) == SEEK_END ? size
                                                         : 0;
    if (offset < -from || offset > size - from) return AVERROR(EINVAL);
    input.at_ = static_cast<size_t>(from + offset);
    return from + offset;
  }

  std::string bytes_;
  size_t at_ = 0;
  AVIOContext* context_ = nullptr;
};

Ffmpeg<AVFormatContext> OpenMp4(const fs::path& file, const MemoryInput& input) {
  AVFormatContext* context = avformat_alloc_context();
  context->pb = input.context();
  const int code = avformat_open_input(&context, "", av_find_input_format("mov"), nullptr);
  if (code < 0) FailVideo(file, code);  // the context is freed
  return Ffmpeg<AVFormatContext>(context);
}

/// Decodes the one track of a video of a set, from its first frame on.
class FrameDecoder {
 public:
  FrameDecoder(const fs::path& file, std::string bytes, std::string sha256, int width_px,
               int height_px)
      : sha256_(std::move(sha256)),
        pixels_(static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px)),
        input_(std::move(bytes)),
        format_(OpenMp4(file, input_)),
        packet_(av_packet_alloc()),
        frame_(av_frame_alloc()) {
    const AVCodec* decoder = avcodec_find_decoder(AV_CODEC_ID_H264);
    const bool is_h264 =
        format_->nb_streams == 1 && format_->streams[0]->codecpar->codec_id == AV_CODEC_ID_H264;
    if (!is_h264 || decoder == nullptr) {
      throw Error(fmt::format(
          "{}: expected one track of H.264, as videos of sets have, found another", file.string()));
    }
    codec_.reset(avcodec_alloc_context3(decoder));
    int code = avcodec_parameters_to_context(codec_.get(), format_->streams[0]->codecpar);
    if (code >= 0) {
      codec_->thread_count = 1;  // views are read on several threads
      codec_->err_recognition = AV_EF_EXPLODE;
      // What is coded is whole blocks of 16x16.
      codec_->max_pixels = (width_px + std::int64_t{32}) * (height_px + std::int64_t{32});
      code = avcodec_open2(codec_.get(), decoder, nullptr);
    }
    if (code < 0) FailVideo(file, code);
  }

  const std::string& sha256() const { return sha256_; }
  int number() const { return number_; }  ///< of the frame it is at; -1 before the first
  /// What it takes, with the frames that others refer to.
  std::uint64_t bytes() const {
    constexpr std::uint64_t kFramesHeld = 10;
    return input_.size() + 3 * kFramesHeld * pixels_;
  }

  /// Frame `number`, which it is at or comes to, in the order they are shown.
  const AVFrame& Frame(int number, const fs::path& file) {
    while (number_ < number) {
      if (!Next(file)) {
        throw Error(fmt::format("{}: expected a frame {}, found {} frames", file.string(), number,
                                number_ + 1));
      }
      ++number_;
    }
    return *frame_;
  }

 private:
  bool Next(const fs::path& file) {
    while (true) {
      const int code = avcodec_receive_frame(codec_.get(), frame_.get());
      if (code == AVERROR_EOF) return false;
      if (code >= 0) return true;
      if (code != AVERROR(EAGAIN)) FailVideo(file, code);
      Send(file);
    }
  }
  void Send(const fs::path& file) {
    av_packet_unref(packet_.get());
    const bool more = av_read_frame(format_.get(), packet_.get()) >= 0;
    const int code = avcodec_send_packet(codec_.get(), more ? packet_.get() : nullptr);
    if (code < 0) FailVideo(file, code);
  }

  std::string sha256_;
  std::uint64_t pixels_;
  MemoryInput input_;
  Ffmpeg<AVFormatContext> format_;
  Ffmpeg<AVCodecContext> codec_;
  Ffmpeg<AVPacket> packet_;
  Ffmpeg<AVFrame> frame_;
  int number_ = -1;
};

/// Decoders of videos that were read from lately: time steps are mostly read one after the other,
/// and the next one then takes one frame more. They are found by content, so that what is read does
/// not depend on what was read before.
class IdleDecoders {
 public:
  /// One that is at the frame or before it, the nearest; none where there is none.
  std::unique_ptr<FrameDecoder> Take(const std::string& sha256, int number) {
    const std::lock_guard lock(mutex_);
    auto best = idle_.end();
    for (auto at = idle_.begin(); at != idle_.end(); ++at) {
      if ((*at)->sha256() != sha256 || (*at)->number() > number) continue;
      if (best == idle_.end() || (*at)->number() > (*best)->number()) best = at;
    }
    if (best == idle_.end()) return nullptr;
    std::unique_ptr<FrameDecoder> taken = std::move(*best);
    idle_.erase(best);
    bytes_ -= taken->bytes();
    return taken;
  }
  void GiveBack(std::unique_ptr<FrameDecoder> decoder) {
    const std::lock_guard lock(mutex_);
    bytes_ += decoder->bytes();
    idle_.push_back(std::move(decoder));
    while (bytes_ > kMostBytes) {
      bytes_ -= idle_.front()->bytes();
      idle_.pop_front();
    }
  }

 private:
  static constexpr std::uint64_t kMostBytes = 256'000'000;
  std::mutex mutex_;
  std::list<std::unique_ptr<FrameDecoder>> idle_;  // the one given back last at the end
  std::uint64_t bytes_ = 0;
};

IdleDecoders& Idle() {
  static IdleDecoders idle;
  return idle;
}

ImageRgb8 FromGbr(const AVFrame& frame, int width_px, int height_px) {
  constexpr std::array<size_t, 3> kPlaneOf{2, 0, 1};  // of R, G and B
  ImageRgb8 image(width_px, height_px, 3);
  for (int y = 0; y < height_px; ++y) {
    for (size_t c = 0; c < 3; ++c) {
      const std::uint8_t* row = frame.data[kPlaneOf[c]] + y * frame.linesize[kPlaneOf[c]];
      for (int x = 0; x < width_px; ++x) image.row(y)[3 * x + static_cast<int>(c)] = row[x];
    }
  }
  return image;
}

ImageRgb8 Pixels(const AVFrame& frame, const fs::path& file, int width_px, int height_px) {
  if (frame.width != width_px || frame.height != height_px) {
    throw Error(fmt::format("{}: expected the view's {}x{} pixels, found {}x{}", file.string(),
                            width_px, height_px, frame.width, frame.height));
  }
  if (frame.format == AV_PIX_FMT_GBRP) return FromGbr(frame, width_px, height_px);
  const bool full_range =
      frame.format == AV_PIX_FMT_YUVJ444P ||
      (frame.format == AV_PIX_FMT_YUV444P && frame.color_range == AVCOL_RANGE_JPEG);
  if (!full_range) {
    throw Error(
        fmt::format("{}: expected a video of full-range 4:4:4 pixels, as sets have, found another",
                    file.string()));
  }
  const std::array<const std::uint8_t*, 3> planes{frame.data[0], frame.data[1], frame.data[2]};
  const std::array<int, 3> rows{frame.linesize[0], frame.linesize[1], frame.linesize[2]};
  return RgbFromYCbCr(planes, rows, width_px, height_px);
}

}  // namespace

void QuietFfmpeg() {
  static std::once_flag once;
  std::call_once(once, [] { av_log_set_level(AV_LOG_QUIET); });
}

ImageRgb8 ReadVideoFrame(const fs::path& file, const StoredFile& stored, int number, int width_px,
                         int height_px) {
  QuietFfmpeg();
  std::string bytes = ReadFile(file, stored.bytes);
  // H.264 has no checksum: damage would decode to something.
  if (Sha256(std::as_bytes(std::span(bytes))) != stored.sha256) {
    throw Error(file.string() +
                ": expected the content that the set records, found another; dtr info with "
                "`verify` names every such file");
  }
  std::unique_ptr<FrameDecoder> decoder = Idle().Take(stored.sha256, number);
  if (!decoder) {
    decoder =
        std::make_unique<FrameDecoder>(file, std::move(bytes), stored.sha256, width_px, height_px);
  }
  ImageRgb8 image = Pixels(decoder->Frame(number, file), file, width_px, height_px);
  Idle().GiveBack(std::move(decoder));
  return image;
}

std::vector<std::uint8_t> YCbCrFromRgb(const ImageRgb8& image) {
  const size_t pixels = static_cast<size_t>(image.width()) * static_cast<size_t>(image.height());
  std::vector<std::uint8_t> planes(3 * pixels);
  const std::uint8_t* rgb = image.data().data();
  for (size_t p = 0; p < pixels; ++p, rgb += 3) {
    const double luma = kRed * rgb[0] + kGreen * rgb[1] + kBlue * rgb[2];
    planes[p] = Level(luma);
    planes[pixels + p] = Level(kMiddle + (rgb[2] - luma) / (2 * (1 - kBlue)));
    planes[2 * pixels + p] = Level(kMiddle + (rgb[0] - luma) / (2 * (1 - kRed)));
  }
  return planes;
}

ImageRgb8 RgbFromYCbCr(std::span<const std::uint8_t* const, 3> planes,
                       std::span<const int, 3> row_bytes, int width_px, int height_px) {
  ImageRgb8 image(width_px, height_px, 3);
  for (int y = 0; y < height_px; ++y) {
    const std::uint8_t* luma = planes[0] + std::ptrdiff_t{y} * row_bytes[0];
    const std::uint8_t* blue = planes[1] + std::ptrdiff_t{y} * row_bytes[1];
    const std::uint8_t* red = planes[2] + std::ptrdiff_t{y} * row_bytes[2];
    std::uint8_t* rgb = image.row(y);
    for (int x = 0; x < width_px; ++x, rgb += 3) {
      const double b = 2 * (1 - kBlue) * (blue[x] - kMiddle);
      const double r = 2 * (1 - kRed) * (red[x] - kMiddle);
      rgb[0] = Level(luma[x] + r);
      rgb[1] = Level(luma[x] - kRed / kGreen * r - kBlue / kGreen * b);
      rgb[2] = Level(luma[x] + b);
    }
  }
  return image;
}

}  // namespace dtr::io
