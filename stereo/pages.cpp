#include "stereo/pages.h"

#include <algorithm>
#include <stdexcept>

namespace dtr::stereo {

void Pages::Drop(const std::function<bool(const PageKey&)>& which) {
  std::erase_if(pages_, [&](const auto& entry) {
    if (!which(entry.first)) return false;
    held_ -= entry.second.bytes;
    return true;
  });
}

void Pages::MakeRoom(std::uint64_t bytes) {
  while (bytes > limit_ || held_ > limit_ - bytes) {
    auto oldest = pages_.end();
    for (auto page = pages_.begin(); page != pages_.end(); ++page) {
      if (page->second.content.use_count() > 1) continue;  // in use
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
}

void Pages::Count(std::uint64_t bytes) {
  held_ += bytes;
  peak_ = std::max(peak_, held_);
}

Pages::Reservation::Reservation(Pages& pages, std::uint64_t bytes) : pages_(pages), bytes_(bytes) {
  pages.MakeRoom(bytes);
  pages.Count(bytes);
}

}  // namespace dtr::stereo
