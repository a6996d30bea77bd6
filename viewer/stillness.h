// viewer/stillness.h -- when something that moved counts as still: the same for every window.
#pragma once
#include <chrono>

namespace dtr::viewer {

/// How long something must be at rest before what is slow is done for it.
inline constexpr double kStillAfterSeconds = 0.15;

/// Seconds on a clock that nobody sets.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  void Restart() { start_ = Clock::now(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// Whether a camera, or whatever an image is of, rests. The very first image need not wait.
class Stillness {
 public:
  void Moved() {
    since_.Restart();
    has_moved_ = true;
  }
  bool still() const { return !has_moved_ || since_.seconds() >= kStillAfterSeconds; }

 private:
  Stopwatch since_;
  bool has_moved_ = false;
};

}  // namespace dtr::viewer
