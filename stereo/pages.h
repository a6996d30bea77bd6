// stereo/pages.h -- what a run holds in memory, never more than a number of bytes.
#pragma once
#include <compare>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace dtr::stereo {

/// Which thing of which view.
struct PageKey {
  enum class Kind { kPixels, kPlanes, kEstimate } kind = Kind::kPixels;
  int pass = 0;  ///< of planes
  int view = 0;
  auto operator<=>(const PageKey&) const = default;
};

/// A cache of things that are loaded when they are wanted. Before it takes anything in, it lets go
/// of what was used the longest ago and is not in use, so that what it holds and what is reserved
/// for work never exceed the limit together. From any thread: who wants what another is loading
/// waits for that.
class Pages {
 public:
  explicit Pages(std::uint64_t limit_bytes = std::numeric_limits<std::uint64_t>::max())
      : limit_(limit_bytes) {}
  static constexpr std::uint64_t kLoadingCopies = 2;
  Pages(const Pages&) = delete;
  Pages& operator=(const Pages&) = delete;

  /// What `load` gives, of `bytes` bytes, in use as long as the pointer lives. On its way from a
  /// file it may be there twice, so room is made for kLoadingCopies of it. Throws std::logic_error
  /// when what is in use leaves no room: who plans the work must see to that.
  template <typename T>
  std::shared_ptr<const T> Get(const PageKey& key, std::uint64_t bytes,
                               const std::function<std::shared_ptr<const T>()>& load) {
    std::unique_lock lock(mutex_);
    for (auto found = pages_.find(key); found != pages_.end(); found = pages_.find(key)) {
      found->second.last_use = ++clock_;
      if (found->second.content) return std::static_pointer_cast<const T>(found->second.content);
      loaded_.wait(lock);
    }
    Take(kLoadingCopies * bytes);
    pages_[key] = {nullptr, kLoadingCopies * bytes, ++clock_};
    lock.unlock();
    std::shared_ptr<const T> content;
    try {
      content = load();
    } catch (...) {
      Loaded(key, nullptr, 0);
      throw;
    }
    Loaded(key, content, bytes);
    return content;
  }

  /// Forgets the pages for which `which` is true.
  void Drop(const std::function<bool(const PageKey&)>& which);

  /// Room for work that the cache does not see, until the reservation is gone.
  class Reservation {
   public:
    Reservation(Pages& pages, std::uint64_t bytes);
    ~Reservation();
    Reservation(const Reservation&) = delete;
    Reservation& operator=(const Reservation&) = delete;

   private:
    Pages& pages_;
    std::uint64_t bytes_;
  };

  std::uint64_t limit() const { return limit_; }
  std::uint64_t held() const { return held_; }  ///< now, reservations included
  std::uint64_t peak() const { return peak_; }

 private:
  struct Page {
    std::shared_ptr<const void> content;  ///< null while it is loaded
    std::uint64_t bytes = 0;
    std::uint64_t last_use = 0;
  };
  /// Makes room for bytes and counts them; with the lock.
  void Take(std::uint64_t bytes);
  /// Ends a page's loading; without content there is no page.
  void Loaded(const PageKey& key, std::shared_ptr<const void> content, std::uint64_t bytes);

  std::mutex mutex_;
  std::condition_variable loaded_;
  std::map<PageKey, Page> pages_;
  std::uint64_t limit_, held_ = 0, peak_ = 0, clock_ = 0;
};

}  // namespace dtr::stereo
