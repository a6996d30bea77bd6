// capture/video/frame_numbers.h -- internal: which frame of the file a decoded one is.
#pragma once
#include <cstdint>
#include <optional>
#include <set>
#include <utility>

namespace dtr::capture {

/// Numbers frames by the file's order of showing, so that those after a damaged one keep theirs. A
/// coded frame that gives none without any error (a second field, one that is never shown) has no
/// number. Times are in the track's units.
class FrameNumbers {
 public:
  using Time = std::optional<std::int64_t>;

  /// A coded frame was read, to be shown and to be decoded at these times.
  void Read(Time shown, Time decoded);
  /// Frames that could not be decoded, of those read.
  void Lose() { ++lost_; }
  /// The number of the next frame that was decoded, from 0.
  int Next(Time shown);

  /// Frames so far, those lost behind the last number included.
  int count() const { return next_ + lost_; }
  /// Of them, those lost behind the last number.
  int lost_behind() const { return lost_; }

 private:
  // Times begin again where streams were joined: `first` counts how often.
  std::set<std::pair<int, std::int64_t>> waiting_;
  Time last_decoded_, last_shown_;
  int joins_read_ = 0, joins_shown_ = 0;
  int next_ = 0;
  int lost_ = 0;  // not yet in next_
};

}  // namespace dtr::capture
