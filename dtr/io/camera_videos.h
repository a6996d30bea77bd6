// dtr/io/camera_videos.h -- images of a dynamic set as videos of its cameras.
#pragma once
#include <filesystem>
#include <string>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"

namespace dtr::io {

/// How images are coded (H.264 by FFmpeg and libx264).
struct VideoQuality {
  bool lossless = false;  ///< every pixel comes back to the bit
  int crf = 18;           ///< else x264's constant rate factor, 1...51: larger is smaller and worse
};

/// Stores the images of the source views again: of each camera (views of equal name and size) the
/// consecutive time steps as videos of ten frames (docs/FORMAT.md, section 3.1), in video/. Masks,
/// held-out views and cameras of one time step stay as they are, and so do the files of before.
/// `set`: its files lie in `set_folder`. `work_folder`: for files on the way. Images in memory at a
/// time take at most `memory_gb` (GB of 1e9 bytes). The same bytes for any number of threads.
/// Throws Error where ffmpeg is missing or fails.
void StoreCameraVideos(const std::filesystem::path& set_folder,
                       const std::filesystem::path& work_folder, DtrSet& set,
                       const VideoQuality& quality, double memory_gb, Progress& progress);

/// "lossless" or a rate factor, as people write them. Throws UsageError for other words.
VideoQuality VideoQualityFrom(const std::string& word);
std::string NameOf(const VideoQuality& quality);

/// Throws UsageError where ffmpeg, which makes the videos, is missing.
void RequireVideoEncoder();

}  // namespace dtr::io
