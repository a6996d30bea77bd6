#include "capture/video/video_decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <span>
#include <string_view>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/regular_file.h"
#include "dtr/io/image_io.h"

extern "C" {
#include <libavutil/dovi_meta.h>
#include <libavutil/spherical.h>
}

namespace dtr::capture {
namespace fs = std::filesystem;
namespace {

// Packets begin with 0x47: of 188 bytes, or of 192 where 4 bytes of time stand before each, as
// camcorders (AVCHD) and Blu-ray discs write them.
bool BeginsAsTransportStream(std::string_view begin) {
  const auto packets = [&](size_t first, size_t bytes) {
    return begin[first] == 'G' && begin[first + bytes] == 'G' && begin[first + 2 * bytes] == 'G';
  };
  return packets(0, 188) || packets(4, 192);
}

bool IsInterlaced(const AVFrame& frame) {
#ifdef AV_FRAME_FLAG_INTERLACED  // since FFmpeg 6.1
  return (frame.flags & AV_FRAME_FLAG_INTERLACED) != 0;
#else
  return frame.interlaced_frame != 0;
#endif
}

// What a stream says of all its frames; empty where it says nothing.
std::span<const std::uint8_t> SideDataOf(const AVStream& stream, AVPacketSideDataType type) {
#if LIBAVFORMAT_VERSION_INT >= AV_VERSION_INT(60, 15, 100)  // since FFmpeg 6.1
  const AVCodecParameters& codec = *stream.codecpar;
  const AVPacketSideData* found =
      av_packet_side_data_get(codec.coded_side_data, codec.nb_coded_side_data, type);
  if (found == nullptr) return {};
  return {found->data, found->size};
#else
  size_t bytes = 0;
  const std::uint8_t* data = av_stream_get_side_data(&stream, type, &bytes);
  if (data == nullptr) return {};
  return {data, bytes};
#endif
}

// FFmpeg would follow a playlist to files and hosts that it names, whatever the file is called:
// only what begins as one of these is given to it.
bool BeginsAsVideo(const fs::path& file) {
  std::array<char, 400> bytes{};  // three packets of a transport stream
  StreamOf(file).read(bytes.data(), bytes.size());
  const std::string_view begin(bytes.data(), bytes.size());
  static constexpr std::array<std::string_view, 10> kBoxes{
      // of MP4, QuickTime and Motion JPEG 2000
      "ftyp", "moov", "mdat", "free", "skip", "wide", "pnot", "styp", "uuid", "jP  "};
  static constexpr std::array<std::string_view, 6> kStarts{
      "\x1a\x45\xdf\xa3",
      "FLV",
      "OggS",
      "\x30\x26\xb2\x75",                 // Matroska, ..., ASF
      std::string_view("\0\0\1\xba", 4),  // MPEG: with sound, and the video alone
      std::string_view("\0\0\1\xb3", 4)};
  if (begin.starts_with("RIFF") && begin.substr(8, 4) == "AVI ") return true;
  if (BeginsAsTransportStream(begin)) return true;
  return std::any_of(kBoxes.begin(), kBoxes.end(),
                     [&](std::string_view box) { return begin.substr(4, 4) == box; }) ||
         std::any_of(kStarts.begin(), kStarts.end(),
                     [&](std::string_view start) { return begin.starts_with(start); });
}

[[noreturn]] void ThrowUnreadable(const fs::path& file, int code) {
  throw Error(
      fmt::format("{}: FFmpeg cannot read it as a video: {}", file.string(), FfmpegError(code)));
}

// Frames that others refer to, and that threads decode at a time.
constexpr double kBytesPerPixel = 40;

std::int64_t MostPixels(double memory_gb) {
  const auto limit = static_cast<double>(io::kImageLimitPx);
  if (memory_gb <= 0) return static_cast<std::int64_t>(limit);
  const double bytes = std::max(memory_gb * kBytesPerGigabyte, kAlwaysAllowedBytes);
  return static_cast<std::int64_t>(std::min(bytes / kBytesPerPixel, limit));
}

// FFmpeg decodes some frames to learn of them.
int FindStreamInfo(AVFormatContext* context, std::int64_t max_pixels) {
  std::vector<AVDictionary*> options(context->nb_streams, nullptr);
  for (AVDictionary*& one : options) av_dict_set_int(&one, "max_pixels", max_pixels, 0);
  const int code = avformat_find_stream_info(context, options.data());
  for (AVDictionary*& one : options) av_dict_free(&one);
  return code;
}

void RequireMemoryFor(const fs::path& file, const AVCodecParameters& frames, double memory_gb) {
  RequireMemory(
      kBytesPerPixel * frames.width * frames.height, memory_gb,
      fmt::format("{}: decoding {}x{} pixels", file.string(), frames.width, frames.height),
      "give more, or a smaller video");
}

Ffmpeg<AVFormatContext> OpenFormat(const fs::path& file, std::int64_t max_pixels) {
  AVDictionary* options = nullptr;
  av_dict_set(&options, "protocol_whitelist", "file", 0);
  av_dict_set(&options, "format_whitelist", "mov,matroska,avi,flv,ogg,asf,mpegts,mpeg,mpegvideo",
              0);
  AVFormatContext* context = nullptr;
  // What stands before a colon at the beginning would be a protocol.
  const std::string url = "file:" + fs::absolute(file).string();
  int code = avformat_open_input(&context, url.c_str(), nullptr, &options);
  av_dict_free(&options);
  if (code < 0) ThrowUnreadable(file, code);
  Ffmpeg<AVFormatContext> format(context);
  code = FindStreamInfo(context, max_pixels);
  if (code < 0) ThrowUnreadable(file, code);
  return format;
}

Ffmpeg<AVCodecContext> OpenCodec(const fs::path& file, const AVStream& stream,
                                 const AVCodec* decoder, std::int64_t max_pixels) {
  Ffmpeg<AVCodecContext> codec(avcodec_alloc_context3(decoder));
  int code = avcodec_parameters_to_context(codec.get(), stream.codecpar);
  if (code >= 0) {
    codec->pkt_timebase = stream.time_base;
    codec->thread_count = 0;  // all cores: the frames do not depend on it
    codec->max_pixels = max_pixels;
    code = avcodec_open2(codec.get(), decoder, nullptr);
  }
  if (code < 0) ThrowUnreadable(file, code);
  return codec;
}

std::optional<DisplayMatrix> MatrixIn(const void* data, size_t bytes) {
  DisplayMatrix matrix{};
  if (data == nullptr || bytes < sizeof matrix) return {};
  const auto* from = static_cast<const std::uint8_t*>(data);
  std::copy_n(from, sizeof matrix, reinterpret_cast<std::uint8_t*>(matrix.data()));
  return matrix;
}

bool IsDamaged(const AVFrame& frame) {
  return (frame.flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame.decode_error_flags != 0;
}

FrameNumbers::Time TimeIn(std::int64_t timestamp) {
  return timestamp == AV_NOPTS_VALUE ? FrameNumbers::Time() : timestamp;
}

FrameNumbers::Time ShownTimeOf(const AVFrame& frame) {
  const FrameNumbers::Time shown = TimeIn(frame.best_effort_timestamp);
  return shown ? shown : TimeIn(frame.pts);
}

}  // namespace

VideoDecoder::VideoDecoder(const fs::path& file, double memory_gb)
    : packet_(av_packet_alloc()), frame_(av_frame_alloc()), held_(av_frame_alloc()) {
  QuietFfmpeg();
  if (!fs::exists(file)) {
    throw Error(fmt::format("{}: expected a video, found no such file", file.string()));
  }
  if (!BeginsAsVideo(file)) {
    throw Error(
        fmt::format("{}: expected a video, found something else by its first bytes; "
                    "playlists are not followed, give the video itself",
                    file.string()));
  }
  format_ = OpenFormat(file, MostPixels(memory_gb));
  const AVCodec* decoder = nullptr;
  stream_index_ = av_find_best_stream(format_.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &decoder, 0);
  if (stream_index_ < 0 || decoder == nullptr) {
    throw Error(fmt::format("{}: holds no video track that FFmpeg decodes", file.string()));
  }
  for (unsigned i = 0; i < format_->nb_streams; ++i) {
    if (static_cast<int>(i) != stream_index_) format_->streams[i]->discard = AVDISCARD_ALL;
  }
  RequireMemoryFor(file, *stream().codecpar, memory_gb);
  codec_ = OpenCodec(file, stream(), decoder, MostPixels(memory_gb));
}

void VideoDecoder::CountDamaged() {
  ++damaged_;
  numbers_.Lose();
}

// An error of sending is one of a frame sent before, also where nothing more is sent: which of the
// two calls reports it depends on the number of threads.
bool VideoDecoder::SendPacket() {
  if (all_sent_) return false;
  int code = 0;
  do {
    av_packet_unref(packet_.get());
    code = av_read_frame(format_.get(), packet_.get());
  } while (code == AVERROR(EAGAIN) || (code >= 0 && packet_->stream_index != stream_index_));
  all_sent_ = code < 0;
  if (!all_sent_ && (packet_->flags & AV_PKT_FLAG_DISCARD) == 0) {  // hidden by an edit list
    const FrameNumbers::Time decoded = TimeIn(packet_->dts);
    const FrameNumbers::Time shown = TimeIn(packet_->pts);
    numbers_.Read(shown ? shown : decoded, decoded);
  }
  code = avcodec_send_packet(codec_.get(), all_sent_ ? nullptr : packet_.get());
  if (code < 0 && code != AVERROR_EOF) CountDamaged();
  return true;
}

bool VideoDecoder::Decode() {
  constexpr int kMaxErrors = 1000;  // without a frame, at the end: FFmpeg itself gives up earlier
  for (int errors_at_end = 0; errors_at_end < kMaxErrors;) {
    const int code = avcodec_receive_frame(codec_.get(), frame_.get());
    if (code == AVERROR_EOF) return false;
    if (code == AVERROR(EAGAIN)) {
      if (!SendPacket()) return false;
    } else if (code < 0 || IsDamaged(*frame_)) {
      CountDamaged();
      errors_at_end += all_sent_;
    } else {
      return true;
    }
  }
  return false;
}

const AVFrame* VideoDecoder::Next() {
  const AVFrame* frame = NextUnnumbered();
  if (frame != nullptr) number_ = numbers_.Next(ShownTimeOf(*frame));
  return frame;
}

const AVFrame* VideoDecoder::NextUnnumbered() {
  while (true) {
    if (deinterlacer_ && deinterlacer_->Get(frame_.get())) return frame_.get();
    if (draining_) {
      draining_ = false;
      deinterlacer_.reset();
      if (held_->width == 0) return nullptr;
      av_frame_move_ref(frame_.get(), held_.get());
    } else if (!Decode()) {
      if (!deinterlacer_) return nullptr;
      draining_ = deinterlacer_->Add(nullptr);
      continue;
    }
    if (IsInterlaced(*frame_)) {
      ++deinterlaced_;
      if (!deinterlacer_) deinterlacer_.emplace(*frame_, stream().time_base);
    }
    if (!deinterlacer_) return frame_.get();
    if (deinterlacer_->Add(frame_.get())) continue;
    av_frame_move_ref(held_.get(), frame_.get());  // of another size
    --deinterlaced_;
    draining_ = deinterlacer_->Add(nullptr);
  }
}

std::optional<double> VideoDecoder::TimeOf(const AVFrame& frame) const {
  const FrameNumbers::Time shown = ShownTimeOf(frame);
  if (!shown) return {};
  const std::int64_t start = TimeIn(stream().start_time).value_or(0);
  return static_cast<double>(*shown - start) * av_q2d(stream().time_base);
}

AVRational VideoDecoder::SampleAspect(const AVFrame& frame) const {
  return av_guess_sample_aspect_ratio(format_.get(), &stream(), const_cast<AVFrame*>(&frame));
}

std::optional<DisplayMatrix> VideoDecoder::MatrixOf(const AVFrame& frame) const {
  if (const AVFrameSideData* own = av_frame_get_side_data(&frame, AV_FRAME_DATA_DISPLAYMATRIX)) {
    return MatrixIn(own->data, own->size);
  }
  const auto data = SideDataOf(stream(), AV_PKT_DATA_DISPLAYMATRIX);
  return MatrixIn(data.data(), data.size());
}

std::string VideoDecoder::Projection() const {
  const auto data = SideDataOf(stream(), AV_PKT_DATA_SPHERICAL);
  if (data.size() < sizeof(AVSphericalMapping)) return "";
  switch (reinterpret_cast<const AVSphericalMapping*>(data.data())->projection) {
    case AV_SPHERICAL_EQUIRECTANGULAR:
      return "equirectangular";
    case AV_SPHERICAL_CUBEMAP:
      return "cubemap";
    default:
      return "part of a sphere";
  }
}

bool VideoDecoder::NeedsDolbyVision() const {
  constexpr int kProfileWithoutBase = 5;
  const auto data = SideDataOf(stream(), AV_PKT_DATA_DOVI_CONF);
  if (data.size() < sizeof(AVDOVIDecoderConfigurationRecord)) return false;
  return reinterpret_cast<const AVDOVIDecoderConfigurationRecord*>(data.data())->dv_profile ==
         kProfileWithoutBase;
}

int VideoDecoder::frames_counted() const {
  constexpr std::int64_t kMax = 1'000'000'000;  // broken headers promise anything
  if (stream().nb_frames <= 0 || stream().nb_frames > kMax) return 0;
  // An edit list has frames decoded, for others to refer to, that are not shown.
  int hidden = 0;
  const int entries = avformat_index_get_entries_count(&stream());
  for (int i = 0; i < entries; ++i) {
    const AVIndexEntry* entry = avformat_index_get_entry(&stream(), i);
    if (entry != nullptr && (entry->flags & AVINDEX_DISCARD_FRAME) != 0) ++hidden;
  }
  const auto counted = static_cast<int>(stream().nb_frames);
  const bool whole_index = std::string_view(format_->iformat->name).starts_with("mov") &&
                           entries > 0 && entries < counted;
  return (whole_index ? entries : counted) - hidden;
}

double VideoDecoder::duration_s() const {
  const bool known = format_->duration_estimation_method != AVFMT_DURATION_FROM_BITRATE;
  if (known && stream().duration != AV_NOPTS_VALUE && stream().duration > 0) {
    return static_cast<double>(stream().duration) * av_q2d(stream().time_base);
  }
  if (!known || format_->duration == AV_NOPTS_VALUE || format_->duration <= 0) return 0;
  return static_cast<double>(format_->duration) / AV_TIME_BASE;
}

double VideoDecoder::frames_per_second() const {
  const AVRational rate = av_guess_frame_rate(format_.get(), &stream(), nullptr);
  return rate.num > 0 && rate.den > 0 ? av_q2d(rate) : 0;
}

int VideoDecoder::video_tracks() const {
  int count = 0;
  for (unsigned i = 0; i < format_->nb_streams; ++i) {
    const AVStream& track = *format_->streams[i];
    if (track.codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
        (track.disposition & (AV_DISPOSITION_ATTACHED_PIC | AV_DISPOSITION_TIMED_THUMBNAILS)) ==
            0) {
      ++count;
    }
  }
  return count;
}

}  // namespace dtr::capture
