// dtr/io/video.h -- frames into an MP4 file, by the ffmpeg program.
#pragma once
#include <filesystem>

#include "dtr/base/progress.h"
#include "dtr/base/work_folder.h"
#include "dtr/types/grid.h"

namespace dtr::io {

/// Of what `dtr` records.
inline constexpr int kVideoFramesPerSecond = 24;

enum class VideoCoding {
  kH264,      ///< yuv420p, constant quality: for people and players
  kLossless,  ///< FFV1 in RGB: every frame reads back to the bit; for a .mkv
};

/// Collects frames and encodes them when finished. The target
/// appears whole or not at all; frames wait for it in TARGET.partial. Throws Error when ffmpeg is
/// missing or fails, UsageError where something else lies in the frames' place.
class VideoWriter {
 public:
  VideoWriter(std::filesystem::path target, int frames_per_second,
              VideoCoding coding = VideoCoding::kH264);

  void Add(const ImageRgb8& frame);
  void Finish(const Progress& progress);

 private:
  std::filesystem::path target_;
  WorkFolder frames_;
  int frames_per_second_;
  VideoCoding coding_;
  int count_ = 0;
};

}  // namespace dtr::io
