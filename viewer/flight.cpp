#include "viewer/flight.h"

#include <algorithm>
#include <utility>

#include "viewer/navigation.h"

namespace dtr::viewer {

void Flight::Replace(std::vector<NovelCamera> keys) {
  keys_ = std::move(keys);
  frames_per_key = 1;
}

void Flight::MoveWorld(const Eigen::Vector3d& origin_shift) {
  Stop();
  for (NovelCamera& key : keys_) key = InMovedWorld(key, origin_shift);
}

std::vector<NovelCamera> Flight::Frames(const PinholeCamera& like) const {
  if (keys_.empty()) return {};
  std::vector<NovelCamera> frames = keys_;
  const int per_key = std::clamp(frames_per_key, 1, kMaxFramesPerKey);
  if (per_key > 1) {
    frames = PathThrough(keys_, static_cast<int>(keys_.size() - 1) * per_key + 1);
  }
  for (NovelCamera& frame : frames) {
    frame.camera = FillLens(frame.camera, like.width_px(), like.height_px());
  }
  return frames;
}

void Flight::StartOrStop(const PinholeCamera& like) {
  flown_ = flying() ? std::vector<NovelCamera>() : Frames(like);
  elapsed_s_ = 0;
}

std::optional<NovelCamera> Flight::Advance(double seconds, double frames_per_second) {
  if (!flying()) return std::nullopt;
  const auto last = static_cast<double>(flown_.size() - 1);
  const double at = std::min(last, elapsed_s_ * frames_per_second);
  elapsed_s_ += std::max(seconds, 0.0);
  const NovelCamera camera = flown_[static_cast<size_t>(at)];
  if (at >= last) Stop();
  return camera;
}

}  // namespace dtr::viewer
