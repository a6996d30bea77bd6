// cli/pipeline/ingest.h -- photos or videos, as a capture.
#pragma once
#include <filesystem>

#include "capture/photo.h"
#include "capture/video/ingest_video.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// The photos of a folder, or the chosen frames of a video or of a folder of videos, which are
/// written into `frames_folder` first (what is there already is removed). Throws as
/// capture::IngestPhotos and capture::IngestVideos do.
capture::Capture Ingest(const std::filesystem::path& source, const capture::VideoOptions& video,
                        const std::filesystem::path& frames_folder, Progress& progress);

}  // namespace dtr::pipeline
