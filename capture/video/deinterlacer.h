// capture/video/deinterlacer.h -- internal: one progressive frame for each interlaced one.
#pragma once
#include "capture/video/ffmpeg_handles.h"

namespace dtr::capture {

/// FFmpeg's bwdif. Frames that are not marked as interlaced pass unchanged. As it looks one frame
/// ahead, it gives a frame once the next one was added.
class Deinterlacer {
 public:
  /// For frames of this one's size and format. Throws std::runtime_error with FFmpeg's reason.
  Deinterlacer(const AVFrame& like, AVRational time_base);

  /// Takes the frame's content; nullptr: no more will come. False where it was not taken, as its
  /// size or format is another one.
  bool Add(AVFrame* frame);
  /// False where another frame has to be added first, and at the end.
  bool Get(AVFrame* frame);

 private:
  Ffmpeg<AVFilterGraph> graph_;
  AVFilterContext* source_ = nullptr;
  AVFilterContext* sink_ = nullptr;
  int width_, height_, format_;
};

}  // namespace dtr::capture
