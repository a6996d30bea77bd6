// dtr/io/ffmpeg_handles.h -- for sources that call FFmpeg: what FFmpeg's libraries allocate, with
// an owner.
#pragma once
#include <memory>
#include <string>

#include "dtr/io/ffmpeg_functions.h"

namespace dtr::io {

struct FfmpegDeleter {
  void operator()(AVFormatContext* context) const { avformat_close_input(&context); }
  void operator()(AVCodecContext* context) const { avcodec_free_context(&context); }
  void operator()(AVFilterGraph* graph) const { avfilter_graph_free(&graph); }
  void operator()(AVFrame* frame) const { av_frame_free(&frame); }
  void operator()(AVPacket* packet) const { av_packet_free(&packet); }
  void operator()(SwsContext* context) const { sws_freeContext(context); }
};

template <typename T>
using Ffmpeg = std::unique_ptr<T, FfmpegDeleter>;

/// FFmpeg writes about damaged frames on standard error as it goes; we report what is missing.
void QuietFfmpeg();

/// FFmpeg's text for one of its error codes.
inline std::string FfmpegError(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = "";
  return av_strerror(code, text, sizeof text) == 0 ? text : "unknown error";
}

}  // namespace dtr::io
