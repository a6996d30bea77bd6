#include "dtr/render/views_within_room.h"

#include <unordered_set>

namespace dtr {

void ViewsWithinRoom::Clear() {
  DropAll();
  used_.clear();
  by_age_.clear();
  bytes_ = 0;
}

void ViewsWithinRoom::Count(const View& view, const Used& use) {
  Used& used = used_[&view];
  by_age_.erase({used.last, &view});
  by_age_.emplace(use.last, &view);
  bytes_ = bytes_ - used.bytes + use.bytes;
  used = use;
}

void ViewsWithinRoom::Drop(const View& view) {
  DropView(view);
  const auto used = used_.find(&view);
  bytes_ -= used->second.bytes;
  by_age_.erase({used->second.last, &view});
  used_.erase(used);
}

bool ViewsWithinRoom::DropOldest() {
  if (by_age_.empty() || by_age_.begin()->first == now_) return false;
  Drop(*by_age_.begin()->second);
  return true;
}

void ViewsWithinRoom::PutAndCount(const RenderFrame& frame, const std::vector<const View*>& views) {
  Put(frame, views);
  for (const View* view : views) Count(*view, {BytesOf(*view), now_});
}

void ViewsWithinRoom::DropUnusedAndCount(const RenderFrame& frame, const View& view) {
  DropUnused(frame, view);
  Count(view, {BytesOf(view), used_[&view].last});
}

size_t ViewsWithinRoom::Prepare(RenderFrame& frame, const std::vector<const View*>& nearest_first) {
  try {
    return PrepareWithinRoom(frame, nearest_first);
  } catch (...) {
    Clear();  // what was prepared by half must not be taken for whole
    throw;
  }
}

bool ViewsWithinRoom::AllFit(const RenderFrame& frame) const {
  return MostBytesOf(frame) <= room_bytes_;
}

size_t ViewsWithinRoom::PrepareWithinRoom(RenderFrame& frame,
                                          const std::vector<const View*>& nearest_first) {
  now_ += 2;
  Begin(frame);
  for (const View* view : nearest_first) {
    const auto found = used_.find(view);
    if (found != used_.end()) Count(*view, {found->second.bytes, now_ - 1});  // others go first
  }
  if (AllFit(frame)) {  // made on all cores
    PutAndCount(frame, nearest_first);
    for (const View* view : nearest_first) {
      if (bytes_ > room_bytes_) DropUnusedAndCount(frame, *view);
    }
    while (bytes_ > room_bytes_ && DropOldest()) {
    }
    return nearest_first.size();
  }
  size_t fitting = 0;
  for (const View* view : nearest_first) {
    PutAndCount(frame, {view});
    DropUnusedAndCount(frame, *view);
    while (bytes_ > room_bytes_ && DropOldest()) {
    }
    if (bytes_ > room_bytes_ && fitting > 0) break;
    ++fitting;
  }
  std::unordered_set<const View*> leaving;
  for (size_t k = fitting; k < nearest_first.size(); ++k) {
    if (used_.contains(nearest_first[k])) Drop(*nearest_first[k]);
    leaving.insert(nearest_first[k]);
  }
  frame.EraseIf([&](const View& view) { return leaving.contains(&view); });
  return fitting;
}

}  // namespace dtr
