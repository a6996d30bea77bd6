#include "dtr/render/views_within_room.h"

#include <algorithm>

namespace dtr {

size_t ViewsWithinRoom::bytes() const {
  size_t sum = 0;
  for (const auto& [view, used] : used_) sum += used.bytes;
  return sum;
}

void ViewsWithinRoom::Clear() {
  DropAll();
  used_.clear();
}

void ViewsWithinRoom::Drop(const View& view) {
  DropView(view);
  used_.erase(&view);
}

bool ViewsWithinRoom::DropOldest() {
  auto oldest = used_.end();
  for (auto it = used_.begin(); it != used_.end(); ++it) {
    if (it->second.last == now_) continue;
    if (oldest == used_.end() || it->second.last < oldest->second.last) oldest = it;
  }
  if (oldest == used_.end()) return false;
  Drop(*oldest->first);
  return true;
}

void ViewsWithinRoom::PutAndCount(const RenderFrame& frame, const std::vector<const View*>& views) {
  Put(frame, views);
  for (const View* view : views) used_[view] = {BytesOf(*view), now_};
}

void ViewsWithinRoom::DropUnusedAndCount(const RenderFrame& frame, const View& view) {
  DropUnused(frame, view);
  used_[&view].bytes = BytesOf(view);
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
    if (found != used_.end()) found->second.last = now_ - 1;  // others go first
  }
  if (AllFit(frame)) {  // made on all cores
    PutAndCount(frame, nearest_first);
    for (const View* view : nearest_first) {
      if (bytes() > room_bytes_) DropUnusedAndCount(frame, *view);
    }
    while (bytes() > room_bytes_ && DropOldest()) {
    }
    return nearest_first.size();
  }
  size_t fitting = 0;
  for (const View* view : nearest_first) {
    PutAndCount(frame, {view});
    DropUnusedAndCount(frame, *view);
    while (bytes() > room_bytes_ && DropOldest()) {
    }
    if (bytes() > room_bytes_ && fitting > 0) break;
    ++fitting;
  }
  for (size_t k = fitting; k < nearest_first.size(); ++k) {
    if (used_.contains(nearest_first[k])) Drop(*nearest_first[k]);
    const auto at = std::find(frame.views.begin(), frame.views.end(), nearest_first[k]);
    frame.Erase(static_cast<size_t>(at - frame.views.begin()));
  }
  return fitting;
}

}  // namespace dtr
