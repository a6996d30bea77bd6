// dtr/base/memory_budget.h -- room for things that several threads hold at a time.
#pragma once
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>

namespace dtr {

/// The unit of every limit on memory, on the command line too.
inline constexpr double kBytesPerGigabyte = 1e9;

/// "4", "0.25": a size in gigabytes, for messages.
inline std::string GigabytesText(size_t bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", static_cast<double>(bytes) / kBytesPerGigabyte);
  return text;
}

/// What a decoded photo takes at most while it is looked at, turned or written: its pixels as they
/// come, as 8 bits, and once more as what they become.
inline constexpr double kBytesPerPhotoPixel = 16;

/// Threads take their share before they load something and wait until there is room for it. One
/// that is larger than all of the room is let through alone: it is work that must be done.
class MemoryBudget {
 public:
  /// In gigabytes; 0: no bound.
  explicit MemoryBudget(double gb) : room_bytes_(gb * kBytesPerGigabyte) {}

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
  double room_bytes_;
  double held_bytes_ = 0;
  int holders_ = 0;
};

}  // namespace dtr
