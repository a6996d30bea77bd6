// pipeline/capture.h -- photos or videos, as a capture.
#pragma once
#include <filesystem>
#include <functional>
#include <vector>

#include "capture/photo.h"
#include "capture/video/ingest_video.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// capture::VideosOf. Throws UsageError where there are none though `video` asks for something of
/// them.
std::vector<std::filesystem::path> VideosFor(const std::filesystem::path& source,
                                             const capture::VideoOptions& video);

/// The photos of a folder, or the chosen frames of a video or of a folder of videos, which are
/// written first into the folder that `frames_folder` names (what is there already is removed); it
/// is asked once it is known that frames are to come. Throws as capture::IngestPhotos and
/// capture::IngestVideos do.
capture::Capture Ingest(const std::filesystem::path& source, const capture::VideoOptions& video,
                        const std::function<std::filesystem::path()>& frames_folder,
                        Progress& progress);

}  // namespace dtr::pipeline
