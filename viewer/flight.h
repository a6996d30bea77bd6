// viewer/flight.h -- key cameras of a path, and flying along it.
#pragma once
#include <optional>
#include <vector>

#include "dtr/render/camera_path.h"

namespace dtr::viewer {

/// The path of a session of the viewer.
class Flight {
 public:
  static constexpr int kMaxFramesPerKey = 240;

  const std::vector<NovelCamera>& keys() const { return keys_; }
  void AddKey(const NovelCamera& key) { keys_.push_back(key); }
  /// Cameras of a file: each is a frame of its own until `frames_per_key` says otherwise.
  void Replace(std::vector<NovelCamera> keys);

  /// The world's origin moved by so much.
  void MoveWorld(const Eigen::Vector3d& origin_shift);

  /// Frames from one key to the next, 1 to kMaxFramesPerKey: with 1 the keys themselves are the
  /// frames, else a smooth path through them, at an even speed.
  int frames_per_key = 24;

  /// All frames with the lens of `like`, whose size is the image's. Empty without a key.
  std::vector<NovelCamera> Frames(const PinholeCamera& like) const;

  /// Flies from the first frame on, or stops. Nothing happens without a key.
  void StartOrStop(const PinholeCamera& like);
  void Stop() { flown_.clear(); }
  bool flying() const { return !flown_.empty(); }
  /// Time passes; where the camera is now. The last frame is never skipped. None when not flying.
  std::optional<NovelCamera> Advance(double seconds, double frames_per_second);

 private:
  std::vector<NovelCamera> keys_, flown_;
  double elapsed_s_ = 0;
};

}  // namespace dtr::viewer
