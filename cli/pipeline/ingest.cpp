#include "cli/pipeline/ingest.h"

#include "capture/ingest.h"

namespace dtr::pipeline {

namespace fs = std::filesystem;

capture::Capture Ingest(const fs::path& source, const capture::VideoOptions& video,
                        const std::function<fs::path()>& frames_folder, Progress& progress) {
  const std::vector<fs::path> videos = capture::VideosOf(source);
  if (videos.empty()) {
    return capture::IngestPhotos(source, {.threads = video.threads, .memory_gb = video.memory_gb},
                                 progress);
  }
  const fs::path frames = frames_folder();
  fs::remove_all(frames);
  fs::create_directories(frames);
  return capture::IngestVideos(videos, video, frames, progress);
}

}  // namespace dtr::pipeline
