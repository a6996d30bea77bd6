// viewer/time_player.h -- which time step of a dynamic set is shown while it is played.
#pragma once
#include <cstddef>

#include "dtr/render/time_steps.h"

namespace dtr::viewer {

/// At the set's own pace or another speed, in a loop or once. Where images take longer than time
/// steps last, time steps are left out; where one takes very long (its views are read), time waits
/// for it.
class TimePlayer {
 public:
  static constexpr double kMinSpeed = 0.125, kMaxSpeed = 8;

  double speed = 1;  ///< seconds of the set in a second; kMinSpeed to kMaxSpeed
  bool loop = true;  ///< begins again after the last time step; else it stops there

  bool playing() const { return playing_; }
  void StartOrStop() { playing_ = !playing_; }
  void Stop() { playing_ = false; }

  /// Time passes; the time step to show now. `shown` is what is shown so far: where that was
  /// changed by hand, it goes on from there.
  size_t Advance(double seconds, const FrameClock& clock, size_t shown);

 private:
  bool playing_ = false;
  double at_s_ = 0;  ///< since the first time step
};

}  // namespace dtr::viewer
