#include "viewer/glfw/photo_cache.h"

#include <chrono>
#include <exception>
#include <utility>

#include "dtr/base/thread_if_any.h"
#include "dtr/report/contact_sheet.h"
#include "viewer/glfw/error_text.h"

namespace dtr::viewer {

PhotoCache::~PhotoCache() {
  if (reading_.valid()) reading_.wait();
}

const ImageRgb8* PhotoCache::Small(const View& view) {
  const auto found = small_.find(&view);
  if (found != small_.end()) return &found->second;
  if (load_ && !RejectionOf(view) && small_asked_.insert(&view).second) {
    small_wanted_.push_back(&view);
  }
  return nullptr;
}

const ImageRgb8* PhotoCache::Whole(const View& view) {
  if (whole_of_ == &view) return &whole_;
  whole_wanted_ = load_ && !RejectionOf(view) ? &view : nullptr;
  return nullptr;
}

const std::string* PhotoCache::RejectionOf(const View& view) const {
  const auto found = rejections_.find(&view);
  return found != rejections_.end() ? &found->second : nullptr;
}

void PhotoCache::Begin(const View& view) {
  View described;  // without pixels, which are others' to change meanwhile
  described.id = view.id;
  described.name = view.name;
  described.role = view.role;
  described.camera = view.camera;
  described.image_file = view.image_file;
  described.image_frame = view.image_frame;
  reading_ = std::async(kThreadIfAny, [load = load_, described, at = &view] {
    Read read;
    read.view = at;
    try {
      read.photo = load(described);
      if (read.photo.empty()) read.rejection = "the set has none";
    } catch (const std::exception& error) {
      read.rejection = Said(error);
    }
    return read;
  });
}

void PhotoCache::Tend() {
  if (reading_.valid()) {
    if (reading_.wait_for(std::chrono::seconds(0)) == std::future_status::timeout) return;
    Read read = reading_.get();
    if (!read.rejection.empty()) {
      rejections_[read.view] = read.rejection;
      small_asked_.erase(read.view);
      if (whole_wanted_ == read.view) whole_wanted_ = nullptr;
    } else {
      if (small_asked_.contains(read.view)) {
        small_[read.view] = report::Shrink(read.photo, small_px_);
      }
      if (whole_wanted_ == read.view) {
        whole_ = std::move(read.photo);
        whole_of_ = std::exchange(whole_wanted_, nullptr);
      }
    }
  }
  if (whole_wanted_ != nullptr) return Begin(*whole_wanted_);
  while (!small_wanted_.empty()) {
    const View* next = small_wanted_.front();
    small_wanted_.pop_front();
    if (!small_.contains(next) && !RejectionOf(*next)) return Begin(*next);
  }
}

bool PhotoCache::reading() const {
  return reading_.valid() || whole_wanted_ != nullptr || !small_wanted_.empty();
}

}  // namespace dtr::viewer
