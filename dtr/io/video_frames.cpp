#include "dtr/io/video_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>

#include "dtr/base/error.h"
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

Ffmpeg<AVFormatContext> OpenMp4(const fs::path& file) {
  AVDictionary* options = nullptr;
  av_dict_set(&options, "protocol_whitelist", "file", 0);
  av_dict_set(&options, "format_whitelist", "mov", 0);
  AVFormatContext* context = nullptr;
  // What stands before a colon at the beginning would be a protocol.
  const std::string url = "file:" + fs::absolute(file).string();
  const int code =
      avformat_open_input(&context, url.c_str(), av_find_input_format("mov"), &options);
  av_dict_free(&options);
  if (code < 0) FailVideo(file, code);
  return Ffmpeg<AVFormatContext>(context);
}

/// Decodes the one track of a video of a set.
class FrameDecoder {
 public:
  FrameDecoder(const fs::path& file, int width_px, int height_px)
      : file_(file), format_(OpenMp4(file)), packet_(av_packet_alloc()), frame_(av_frame_alloc()) {
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

  /// The next frame in the order they are shown; nullptr after the last.
  const AVFrame* Next() {
    while (true) {
      const int code = avcodec_receive_frame(codec_.get(), frame_.get());
      if (code == AVERROR_EOF) return nullptr;
      if (code >= 0) return frame_.get();
      if (code != AVERROR(EAGAIN)) FailVideo(file_, code);
      Send();
    }
  }

 private:
  void Send() {
    av_packet_unref(packet_.get());
    const bool more = av_read_frame(format_.get(), packet_.get()) >= 0;
    const int code = avcodec_send_packet(codec_.get(), more ? packet_.get() : nullptr);
    if (code < 0) FailVideo(file_, code);
  }

  const fs::path& file_;
  Ffmpeg<AVFormatContext> format_;
  Ffmpeg<AVCodecContext> codec_;
  Ffmpeg<AVPacket> packet_;
  Ffmpeg<AVFrame> frame_;
};

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

ImageRgb8 ReadVideoFrame(const fs::path& file, const std::string& sha256, int number, int width_px,
                         int height_px) {
  QuietFfmpeg();
  // H.264 has no checksum: damage would decode to something.
  if (Sha256OfFile(file) != sha256) {
    throw Error(file.string() +
                ": expected the content that the set records, found another; dtr info with "
                "`verify` names every such file");
  }
  FrameDecoder decoder(file, width_px, height_px);
  const AVFrame* frame = nullptr;
  for (int i = 0; i <= number; ++i) {
    frame = decoder.Next();
    if (frame == nullptr) {
      throw Error(
          fmt::format("{}: expected a frame {}, found {} frames", file.string(), number, i));
    }
  }
  return Pixels(*frame, file, width_px, height_px);
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
      const double b = luma[x] + 2 * (1 - kBlue) * (blue[x] - kMiddle);
      const double r = luma[x] + 2 * (1 - kRed) * (red[x] - kMiddle);
      rgb[0] = Level(r);
      rgb[1] = Level((luma[x] - kRed * r - kBlue * b) / kGreen);
      rgb[2] = Level(b);
    }
  }
  return image;
}

}  // namespace dtr::io
