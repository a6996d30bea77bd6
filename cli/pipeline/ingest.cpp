#include "cli/pipeline/ingest.h"

#include "capture/ingest.h"

namespace dtr::pipeline {

namespace fs = std::filesystem;

capture::Capture Ingest(const fs::path& source, const capture::VideoOptions& video,
                        const fs::path& frames_folder, Progress& progress) {
  const std::vector<fs::path> videos = capture::VideosOf(source);
  if (videos.empty()) return capture::IngestPhotos(source, {.threads = video.threads}, progress);
  fs::remove_all(frames_folder);
  fs::create_directories(frames_folder);
  return capture::IngestVideos(videos, video, frames_folder, progress);
}

}  // namespace dtr::pipeline
