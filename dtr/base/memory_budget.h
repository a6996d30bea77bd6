// dtr/base/memory_budget.h -- what may be in memory at a time, in all and of a single thing.
#pragma once
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>

namespace dtr {

/// The unit of every limit on memory, on the command line too.
inline constexpr double kBytesPerGigabyte = 1e9;

/// "4", "0.25": a size in gigabytes, for messages.
inline std::string GigabytesText(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", bytes / kBytesPerGigabyte);
  return text;
}

/// Things that take no more are never rejected: the program itself takes as much.
inline constexpr double kAlwaysAllowedBytes = 64e6;

/// To be called before anything is allocated whose size input decides. Throws dtr::Error, "SUBJECT
/// takes 3.2 GB of memory, more than `memory` 0.5; ADVICE", where it alone exceeds the limit, in
/// gigabytes (0: none).
void RequireMemory(double bytes, double limit_gb, const std::string& subject,
                   const std::string& advice);

/// What a decoded photo takes at most while it is looked at, turned or written: its pixels as they
/// come, as 8 bits, and once more as what they become.
inline constexpr double kBytesPerPhotoPixel = 16;

/// Threads take their share before they load something and wait until there is room for it. One
/// that is larger than all of the room is let through alone: RequireMemory has rejected before what
/// is not to be done.
class MemoryBudget {
 public:
  /// In gigabytes; 0: no bound.
  explicit MemoryBudget(double gb) : gb_(gb), room_bytes_(gb * kBytesPerGigabyte) {}
  double gb() const { return gb_; }

  /// Given back at the end of its scope.
  class Share {
   public:
    Share(MemoryBudget& budget, double bytes) : budget_(budget), bytes_(bytes) {}
    ~Share() { budget_.GiveBack(bytes_); }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;

   private:
    MemoryBudget& budget_;
    double bytes_;
  };

  [[nodiscard]] Share Take(double bytes) {
    std::unique_lock lock(mutex_);
    given_back_.wait(lock, [&] {
      return room_bytes_ <= 0 || holders_ == 0 || held_bytes_ + bytes <= room_bytes_;
    });
    held_bytes_ += bytes;
    ++holders_;
    return {*this, bytes};
  }
  [[nodiscard]] Share TakeForPhoto(int width_px, int height_px) {
    return Take(kBytesPerPhotoPixel * width_px * height_px);
  }

 private:
  void GiveBack(double bytes) {
    {
      const std::lock_guard lock(mutex_);
      held_bytes_ -= bytes;
      --holders_;
    }
    given_back_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable given_back_;
  double gb_, room_bytes_;
  double held_bytes_ = 0;
  int holders_ = 0;
};

}  // namespace dtr
