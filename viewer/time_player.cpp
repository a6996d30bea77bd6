#include "viewer/time_player.h"

#include <algorithm>
#include <cmath>

namespace dtr::viewer {
namespace {

constexpr double kLongestPlayedSeconds = 0.1;  // a slow frame must not leave half a second out

}  // namespace

size_t TimePlayer::Advance(double seconds, const FrameClock& clock, size_t shown) {
  if (!playing_ || clock.FrameAt(at_s_) != shown) at_s_ = clock.StartOf(shown);
  if (!playing_) return shown;
  at_s_ += speed * std::clamp(seconds, 0.0, kLongestPlayedSeconds);
  if (loop || at_s_ < clock.period_s()) {
    at_s_ = std::fmod(at_s_, clock.period_s());
    return clock.FrameAt(at_s_);
  }
  playing_ = false;
  return clock.frames() - 1;
}

}  // namespace dtr::viewer
