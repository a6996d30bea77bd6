// capture/video/ffmpeg_handles.h -- internal: owners of what FFmpeg's libraries allocate.
#pragma once
#include "dtr/io/ffmpeg_handles.h"

namespace dtr::capture {

using io::Ffmpeg;
using io::FfmpegError;
using io::QuietFfmpeg;

}  // namespace dtr::capture
