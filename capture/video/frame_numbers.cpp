#include "capture/video/frame_numbers.h"

#include <algorithm>
#include <iterator>

namespace dtr::capture {

void FrameNumbers::Read(Time shown, Time decoded) {
  if (decoded && last_decoded_ && *decoded < *last_decoded_) ++joins_read_;
  if (decoded) last_decoded_ = decoded;
  if (shown) waiting_.emplace(joins_read_, *shown);
}

int FrameNumbers::Next(Time shown) {
  int skipped = lost_;  // without times, frames are lost where the decoder reports it
  if (shown) {
    if (last_shown_ && *shown < *last_shown_ && joins_shown_ < joins_read_) ++joins_shown_;
    last_shown_ = shown;
    const auto later = waiting_.upper_bound({joins_shown_, *shown});
    const auto passed = static_cast<int>(std::distance(waiting_.begin(), later));
    waiting_.erase(waiting_.begin(), later);
    skipped = std::clamp(passed - 1, 0, lost_);
  }
  lost_ -= skipped;
  next_ += skipped + 1;
  return next_ - 1;
}

}  // namespace dtr::capture
