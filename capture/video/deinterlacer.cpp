#include "capture/video/deinterlacer.h"

#include <fmt/format.h>

#include <stdexcept>

namespace dtr::capture {
namespace {

void Require(int result, const char* what) {
  if (result >= 0) return;
  throw std::runtime_error(fmt::format("{}: {}", what, FfmpegError(result)));
}

AVFilterContext* Create(AVFilterGraph* graph, const char* filter, const std::string& arguments) {
  AVFilterContext* context = nullptr;
  Require(avfilter_graph_create_filter(&context, avfilter_get_by_name(filter), filter,
                                       arguments.c_str(), nullptr, graph),
          filter);
  return context;
}

}  // namespace

Deinterlacer::Deinterlacer(const AVFrame& like, AVRational time_base)
    : graph_(avfilter_graph_alloc()),
      width_(like.width),
      height_(like.height),
      format_(like.format) {
  source_ = Create(graph_.get(), "buffer",
                   fmt::format("video_size={}x{}:pix_fmt={}:time_base={}/{}", width_, height_,
                               format_, time_base.num, time_base.den));
  AVFilterContext* filter =
      Create(graph_.get(), "bwdif", "mode=send_frame:parity=auto:deint=interlaced");
  sink_ = Create(graph_.get(), "buffersink", "");
  Require(avfilter_link(source_, 0, filter, 0), "bwdif");
  Require(avfilter_link(filter, 0, sink_, 0), "bwdif");
  Require(avfilter_graph_config(graph_.get(), nullptr), "bwdif");
}

bool Deinterlacer::Add(AVFrame* frame) {
  if (frame != nullptr &&
      (frame->width != width_ || frame->height != height_ || frame->format != format_)) {
    return false;
  }
  Require(av_buffersrc_add_frame(source_, frame), "bwdif");
  return true;
}

bool Deinterlacer::Get(AVFrame* frame) {
  const int result = av_buffersink_get_frame(sink_, frame);
  if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return false;
  Require(result, "bwdif");
  return true;
}

}  // namespace dtr::capture
