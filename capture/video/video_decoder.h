// capture/video/video_decoder.h -- internal: coded frames of a file, in the order they are shown.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/video/deinterlacer.h"
#include "capture/video/display_matrix.h"
#include "capture/video/ffmpeg_handles.h"
#include "capture/video/frame_numbers.h"

namespace dtr::capture {

/// Opens and decodes one video track with FFmpeg's libraries. Nothing is converted here, except
/// that interlaced frames are deinterlaced.
class VideoDecoder {
 public:
  /// Throws Error where FFmpeg does not read the file, or its frames would take more memory than
  /// that, 1e9 bytes (0: no bound).
  VideoDecoder(const std::filesystem::path& file, double memory_gb);

  /// The next frame that could be decoded; nullptr after the last one. Valid until the next call.
  const AVFrame* Next();
  /// Of that frame: its number in the file, from 0, where damaged frames have theirs.
  int number() const { return number_; }
  int count() const { return numbers_.count(); }  ///< frames so far, damaged ones included
  /// Of them, damaged ones after that frame.
  int lost_behind() const { return numbers_.lost_behind(); }

  /// Seconds from the first frame's time on, if the file says it.
  std::optional<double> TimeOf(const AVFrame& frame) const;
  /// Of the pixels of this frame: width over height.
  AVRational SampleAspect(const AVFrame& frame) const;
  /// The matrix of this frame (H.264 and HEVC can hold one), else of the track; nothing where
  /// neither has one.
  std::optional<DisplayMatrix> MatrixOf(const AVFrame& frame) const;
  /// Of spherical video: "equirectangular" or another word; empty where the file states none.
  std::string Projection() const;
  /// Dolby Vision without a base layer that others can show.
  bool NeedsDolbyVision() const;

  int frames_counted() const;               ///< by the file's own index; 0 where it has none
  double duration_s() const;                ///< 0 where the file does not say
  double frames_per_second() const;         ///< 0 where the file does not say
  int video_tracks() const;                 ///< in the file; the one FFmpeg ranks first is read
  int damaged() const { return damaged_; }  ///< frames left out so far
  int deinterlaced() const { return deinterlaced_; }

 private:
  AVStream& stream() const { return *format_->streams[stream_index_]; }
  const AVFrame* NextUnnumbered();
  void CountDamaged();
  bool Decode();      // into frame_; false at the end
  bool SendPacket();  // to the decoder; false once all were sent

  Ffmpeg<AVFormatContext> format_;
  Ffmpeg<AVCodecContext> codec_;
  Ffmpeg<AVPacket> packet_;
  Ffmpeg<AVFrame> frame_;
  Ffmpeg<AVFrame> held_;  // the first of another size, while the deinterlacer gives what it has
  std::optional<Deinterlacer> deinterlacer_;
  int stream_index_ = -1;
  FrameNumbers numbers_;
  bool all_sent_ = false, draining_ = false;
  int number_ = -1, damaged_ = 0, deinterlaced_ = 0;
};

}  // namespace dtr::capture
