// dtr/io/video.h -- frames into an MP4 file, by the ffmpeg program.
#pragma once
#include <filesystem>

#include "dtr/base/progress.h"
#include "dtr/base/work_folder.h"
#include "dtr/types/grid.h"

namespace dtr::io {

/// Of what `dtr` records.
inline constexpr int kVideoFramesPerSecond = 24;

/// Collects frames and encodes them (H.264, yuv420p, constant quality) when finished. The target
/// appears whole or not at all; frames wait for it in TARGET.partial. Throws Error when ffmpeg is
/// missing or fails, UsageError where something else lies in the frames' place.
class VideoWriter {
 public:
  VideoWriter(std::filesystem::path target, int frames_per_second);

  void Add(const ImageRgb8& frame);
  void Finish(const Progress& progress);

 private:
  std::filesystem::path target_;
  WorkFolder frames_;
  int frames_per_second_;
  int count_ = 0;
};

}  // namespace dtr::io
