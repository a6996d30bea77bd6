#include "stereo/pages.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace dtr::stereo {

void Pages::Drop(const std::function<bool(const PageKey&)>& which) {
  const std::lock_guard lock(mutex_);
  std::erase_if(pages_, [&](const auto& entry) {
    if (!which(entry.first)) return false;
    held_ -= entry.second.bytes;
    return true;
  });
}

void Pages::Take(std::uint64_t bytes) {
  while (bytes > limit_ || held_ > limit_ - bytes) {
    auto oldest = pages_.end();
    for (auto page = pages_.begin(); page != pages_.end(); ++page) {
      if (page->second.content.use_count() != 1) continue;  // in use, or loaded now
      if (oldest == pages_.end() || page->second.last_use < oldest->second.last_use) oldest = page;
    }
    if (oldest == pages_.end()) {
      throw std::logic_error("pages: " + std::to_string(held_) + " bytes are in use, " +
                             std::to_string(bytes) + " more are wanted of " +
                             std::to_string(limit_));
    }
    held_ -= oldest->second.bytes;
    pages_.erase(oldest);
  }
  held_ += bytes;
  peak_ = std::max(peak_, held_);
}

void Pages::Loaded(const PageKey& key, std::shared_ptr<const void> content, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  Page& page = pages_.at(key);
  held_ -= page.bytes - bytes;
  page.bytes = bytes;
  page.content = std::move(content);
  if (!page.content) pages_.erase(key);
  loaded_.notify_all();
}

Pages::Reservation::Reservation(Pages& pages, std::uint64_t bytes) : pages_(pages), bytes_(bytes) {
  const std::lock_guard lock(pages.mutex_);
  pages.Take(bytes);
}

Pages::Reservation::~Reservation() {
  const std::lock_guard lock(pages_.mutex_);
  pages_.held_ -= bytes_;
}

}  // namespace dtr::stereo
