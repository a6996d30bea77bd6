// capture/video/frames.h -- a video, frame by frame.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "dtr/types/grid.h"

namespace dtr::capture {

/// True for the extensions of videos that are read, any case, with the dot.
bool IsVideoExtension(const std::string& extension);

/// Decodes a video from its first frame on (OpenCV's videoio, so FFmpeg), upright where the file
/// says how it was held.
class VideoReader {
 public:
  /// Throws Error where the file is no video.
  explicit VideoReader(const std::filesystem::path& file);
  ~VideoReader();

  /// Goes to the next frame; false after the last one, and where the rest cannot be decoded.
  bool Next();
  /// The frame that Next() went to: its number from 0, when it is shown, and its pixels. Throws
  /// Error where it is not of 8-bit colours.
  int number() const { return number_; }
  double time_s() const { return time_s_; }
  ImageRgb8 Picture() const;

  /// What the file says of itself; 0 where it does not tell. A file cut short says more frames than
  /// it holds.
  int frames_promised() const;
  double frames_per_second() const;

 private:
  struct Decoder;
  std::filesystem::path file_;
  std::unique_ptr<Decoder> decoder_;
  int number_ = -1;
  double time_s_ = 0;
};

/// Calls `take` with each frame's number and picture; stops when it returns false. Throws Error
/// where the file is no video or holds no frame.
void ForEachFrame(const std::filesystem::path& file,
                  const std::function<bool(int, const ImageRgb8&)>& take);

}  // namespace dtr::capture
