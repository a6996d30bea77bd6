// viewer/time_player.h -- which time step of a dynamic set is shown while it is played.
#pragma once
#include <cstddef>

#include "dtr/render/time_steps.h"

namespace dtr::viewer {

/// Round and round at the set's own pace. Where images take longer than time steps last, time steps
/// are left out; where one takes very long (its views are read), time waits for it.
class TimePlayer {
 public:
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
