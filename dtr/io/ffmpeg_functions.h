// dtr/io/ffmpeg_functions.h -- for sources that call FFmpeg: its functions by their own names. The
// libraries, with the 160 that they need, are loaded when one of theirs is called first.
#pragma once
#include <atomic>

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavfilter/avfilter.h>
#include <libavfilter/buffersink.h>
#include <libavfilter/buffersrc.h>
#include <libavformat/avformat.h>
#include <libavutil/frame.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

namespace dtr {

/// The address of a library's function. Throws Error where there is none.
void* FfmpegSymbol(const char* library, const char* function);

template <typename Signature>
class FfmpegFunction;

template <typename Result, typename... Parameters>
class FfmpegFunction<Result(Parameters...)> {
 public:
  constexpr FfmpegFunction(const char* library, const char* name)
      : library_(library), name_(name) {}
  Result operator()(Parameters... arguments) {
    auto* function = function_.load(std::memory_order_relaxed);
    if (function == nullptr) {
      function = reinterpret_cast<Result (*)(Parameters...)>(FfmpegSymbol(library_, name_));
      function_.store(function, std::memory_order_relaxed);
    }
    return function(arguments...);
  }

 private:
  const char* library_;
  const char* name_;
  std::atomic<Result (*)(Parameters...)> function_ = nullptr;
};

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wignored-attributes"  // pure, allocating: hints at each call
// Names in this namespace come before the global ones; one that is missing here does not link.
#define DTR_FFMPEG(library, version, name) \
  inline FfmpegFunction<decltype(::name)> name("lib" library ".so." AV_STRINGIFY(version), #name)
#define DTR_AVUTIL(name) DTR_FFMPEG("avutil", LIBAVUTIL_VERSION_MAJOR, name)
#define DTR_AVCODEC(name) DTR_FFMPEG("avcodec", LIBAVCODEC_VERSION_MAJOR, name)
#define DTR_AVFORMAT(name) DTR_FFMPEG("avformat", LIBAVFORMAT_VERSION_MAJOR, name)
#define DTR_AVFILTER(name) DTR_FFMPEG("avfilter", LIBAVFILTER_VERSION_MAJOR, name)
#define DTR_SWSCALE(name) DTR_FFMPEG("swscale", LIBSWSCALE_VERSION_MAJOR, name)

DTR_AVUTIL(av_color_primaries_name);
DTR_AVUTIL(av_color_space_name);
DTR_AVUTIL(av_color_transfer_name);
DTR_AVUTIL(av_dict_free);
DTR_AVUTIL(av_dict_set);
DTR_AVUTIL(av_dict_set_int);
DTR_AVUTIL(av_frame_alloc);
DTR_AVUTIL(av_frame_free);
DTR_AVUTIL(av_frame_get_side_data);
DTR_AVUTIL(av_frame_move_ref);
DTR_AVUTIL(av_freep);
DTR_AVUTIL(av_log_set_level);
DTR_AVUTIL(av_malloc);
DTR_AVUTIL(av_opt_set_int);
DTR_AVUTIL(av_pix_fmt_desc_get);
DTR_AVUTIL(av_strerror);

DTR_AVCODEC(av_packet_alloc);
DTR_AVCODEC(av_packet_free);
DTR_AVCODEC(av_packet_unref);
DTR_AVCODEC(avcodec_alloc_context3);
DTR_AVCODEC(avcodec_find_decoder);
DTR_AVCODEC(avcodec_free_context);
DTR_AVCODEC(avcodec_open2);
DTR_AVCODEC(avcodec_parameters_to_context);
DTR_AVCODEC(avcodec_receive_frame);
DTR_AVCODEC(avcodec_send_packet);

DTR_AVFORMAT(av_find_best_stream);
DTR_AVFORMAT(av_find_input_format);
DTR_AVFORMAT(av_guess_frame_rate);
DTR_AVFORMAT(av_guess_sample_aspect_ratio);
DTR_AVFORMAT(av_read_frame);
DTR_AVFORMAT(avformat_alloc_context);
DTR_AVFORMAT(avformat_close_input);
DTR_AVFORMAT(avformat_find_stream_info);
DTR_AVFORMAT(avformat_index_get_entries_count);
DTR_AVFORMAT(avformat_index_get_entry);
DTR_AVFORMAT(avformat_open_input);
DTR_AVFORMAT(avio_alloc_context);
DTR_AVFORMAT(avio_context_free);
#if LIBAVFORMAT_VERSION_INT >= AV_VERSION_INT(60, 15, 100)  // since FFmpeg 6.1
DTR_AVCODEC(av_packet_side_data_get);
#else
DTR_AVFORMAT(av_stream_get_side_data);
#endif

DTR_AVFILTER(av_buffersink_get_frame);
DTR_AVFILTER(av_buffersrc_add_frame);
DTR_AVFILTER(avfilter_get_by_name);
DTR_AVFILTER(avfilter_graph_alloc);
DTR_AVFILTER(avfilter_graph_config);
DTR_AVFILTER(avfilter_graph_create_filter);
DTR_AVFILTER(avfilter_graph_free);
DTR_AVFILTER(avfilter_link);

DTR_SWSCALE(sws_alloc_context);
DTR_SWSCALE(sws_freeContext);
DTR_SWSCALE(sws_getCoefficients);
DTR_SWSCALE(sws_init_context);
DTR_SWSCALE(sws_isSupportedInput);
DTR_SWSCALE(sws_scale);
DTR_SWSCALE(sws_setColorspaceDetails);

#undef DTR_SWSCALE
#undef DTR_AVFILTER
#undef DTR_AVFORMAT
#undef DTR_AVCODEC
#undef DTR_AVUTIL
#undef DTR_FFMPEG
#pragma GCC diagnostic pop

}  // namespace dtr
