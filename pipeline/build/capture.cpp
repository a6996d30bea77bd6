#include "pipeline/build/capture.h"

#include "capture/ingest.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {

namespace fs = std::filesystem;

std::vector<fs::path> VideosFor(const fs::path& source, const capture::VideoOptions& video) {
  std::vector<fs::path> videos = capture::VideosOf(source);
  const capture::VideoOptions plain;
  // What is not there is reported by who reads it.
  if (videos.empty() && fs::exists(source) &&
      (video.every != plain.every || video.motion != plain.motion || video.most != plain.most ||
       video.synchronised)) {
    throw UsageError(source.string() +
                     ": expected a video or a folder of nothing but videos for `every`, `motion`, "
                     "`max_frames` and `synchronised`, found neither; leave them out");
  }
  return videos;
}

capture::Capture Ingest(const fs::path& source, const capture::VideoOptions& video,
                        capture::PanoramaUse panoramas,
                        const std::function<fs::path()>& frames_folder, Progress& progress) {
  const std::vector<fs::path> videos = VideosFor(source, video);
  capture::Capture photos;
  if (videos.empty()) {
    photos = capture::IngestPhotos(source, {.memory_gb = video.memory_gb}, progress);
  } else {
    const fs::path frames = frames_folder();
    RemoveTree(frames);
    fs::create_directories(frames);
    photos = capture::IngestVideos(videos, video, frames, progress);
  }
  if (!capture::ArePanoramas(photos, panoramas, &progress)) return photos;
  const fs::path views = frames_folder() / "views";
  RemoveTree(views);
  return capture::SplitPanoramas(photos, views, progress);
}

}  // namespace dtr::pipeline
