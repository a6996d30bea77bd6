// cli/video_options.h -- options of the commands that take videos for photos.
#pragma once
#include <CLI/CLI.hpp>

#include "capture/video/ingest_video.h"

namespace dtr::cli {

/// --every, --motion, --max-frames and --synchronised.
void AddVideoOptions(CLI::App& command, capture::VideoOptions& options);

}  // namespace dtr::cli
