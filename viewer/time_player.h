// viewer/time_player.h -- which instant of a moving set is shown while it is played.
#pragma once
#include <cstddef>

#include "dtr/render/instants.h"

namespace dtr::viewer {

/// Round and round at the set's own pace. Where pictures take longer than instants last, instants
/// are left out; where one takes very long (its views are read), time waits for it.
class TimePlayer {
 public:
  bool playing() const { return playing_; }
  void StartOrStop() { playing_ = !playing_; }
  void Stop() { playing_ = false; }

  /// Time passes; the instant to show now. `shown` is what is shown so far: where that was changed
  /// by hand, it goes on from there.
  size_t Advance(double seconds, const FrameClock& clock, size_t shown);

 private:
  bool playing_ = false;
  double at_s_ = 0;  ///< since the first instant
};

}  // namespace dtr::viewer
