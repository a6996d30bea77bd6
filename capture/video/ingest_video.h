// capture/video/ingest_video.h -- videos become a Capture: frames worth keeping, as photos.
#pragma once
#include <filesystem>
#include <vector>

#include "capture/photo.h"
#include "dtr/base/progress.h"

namespace dtr::capture {

struct VideoOptions {
  /// Take every N-th frame, whatever it shows; 0: choose by motion and sharpness (FrameChooser).
  int every = 0;
  /// Motion of the image between frames that are taken, of its long side. 0.06 leaves about nine
  /// tenths of the image to its successor and two thirds to the fifth after it.
  double motion = 0.06;
  int most = 0;  ///< at most so many frames of each video: the sharpest of equal parts; 0: no limit
  /// The videos began at the same moment and run at the same rate, as a rig's do: the same frames
  /// are taken of each. Else each video is looked at for itself.
  bool synchronised = false;
  double memory_gb = 0;  ///< as IngestOptions::memory_gb, of the frames that were taken
};

/// `source` itself where it is a video; the videos of a folder that has neither photos nor folders
/// beside them in which photos are looked for (not IsOwnFolder), in byte order of their names, and
/// of videos and proxies the videos; else nothing.
std::vector<std::filesystem::path> VideosOf(const std::filesystem::path& source);

/// Decodes the videos twice, once to choose and once to write the chosen frames into `folder`
/// (which must be new or empty) as JPEG of quality 98: frame_NNNNNN.jpg by number in the video, of
/// several videos below a folder with the video's name. The photos say which frame of which video
/// they are, and those of one video share a camera. What could not be decoded, and of synchronised
/// videos what is longer than the shortest, is listed under `skipped`. Holds a few images at a
/// time. The same videos and options give the same bytes.
/// Throws Error where a file is no video, has a name that is no UTF-8, holds no frame or no frame
/// with texture, cannot be decoded a second time, or synchronised videos differ in rate; UsageError
/// for options out of range.
Capture IngestVideos(const std::vector<std::filesystem::path>& videos, const VideoOptions& options,
                     const std::filesystem::path& folder, Progress& progress);

}  // namespace dtr::capture
