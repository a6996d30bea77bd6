// capture/video/frames.h -- a video, frame by frame.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dtr/io/image_io.h"
#include "dtr/types/grid.h"

namespace dtr::capture {

/// Decodes a video from its first frame on with FFmpeg's libraries. What the file says about its
/// frames is applied here: rotation and mirroring (the display matrix), pixels that are not square,
/// colour matrix and range, HDR and wide gamut (io::SrgbConverter), interlacing (bwdif).
class VideoReader {
 public:
  /// Throws Error where the file is no video, or decoding it would take more memory than that, 1e9
  /// bytes (0: no bound).
  explicit VideoReader(const std::filesystem::path& file, double memory_gb = io::kImageMemoryGb);
  ~VideoReader();

  /// Goes to the next frame; false after the last one, where the rest cannot be decoded, and where
  /// frames change their size. Throws Error where frames cannot be converted.
  bool Next();
  /// The frame that Next() went to: its number in the file from 0 (damaged frames that are left out
  /// have theirs), when it is shown (from the first frame's time on), and its pixels: upright,
  /// 8-bit sRGB.
  int number() const { return number_; }
  double time_s() const { return time_s_; }
  ImageRgb8 Picture() const;

  /// What the file says of itself; 0 where it does not tell. A file cut short says more frames than
  /// it holds.
  int frames_promised() const;
  /// Whether so many frames are fewer than that by more than headers count too many.
  bool PromisesMoreThan(int frames) const;
  /// Frames of the file so far, damaged ones included.
  int frames_so_far() const;
  double frames_per_second() const;
  /// Of spherical video: "equirectangular" or another word; empty where the file states none.
  std::string Projection() const;

  /// Of the frames so far: one line for each thing that was converted, or that is not used.
  const std::vector<std::string>& remarks() const { return remarks_; }
  /// Why frames up to this one are less than the file holds or promises: cut short, damaged frames
  /// left out, another size. Empty where nothing is missing. Meant for the end.
  std::string WhyIncomplete() const;

 private:
  struct Parts;
  void Remark(const std::string& line);

  std::filesystem::path file_;
  std::unique_ptr<Parts> parts_;
  std::vector<std::string> remarks_;
  std::string why_ended_;
  int number_ = -1;
  double time_s_ = 0;
};

/// Calls `take` with each frame's number and image; stops when it returns false. Throws Error
/// where the file is no video or holds no frame.
void ForEachFrame(const std::filesystem::path& file,
                  const std::function<bool(int, const ImageRgb8&)>& take);

}  // namespace dtr::capture
