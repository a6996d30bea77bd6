#include "dtr/render/view_stream.h"

#include <algorithm>
#include <cassert>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <tuple>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/render/valid_views.h"

namespace dtr {
namespace {

size_t PixelsOf(int width_px, int height_px) {
  return static_cast<size_t>(width_px) * static_cast<size_t>(height_px);
}

/// What RenderScene's readers keep of a view: 8-bit RGB, float depth, a mask where there is one.
size_t BytesOf(const View& view) {
  const size_t image = PixelsOf(view.camera.width_px(), view.camera.height_px());
  const size_t depth = PixelsOf(view.camera.width_px() / view.depth_scale,
                                view.camera.height_px() / view.depth_scale);
  // A rectangle of a mesh takes 2 bytes in the file.
  const size_t mesh =
      view.mesh_file ? view.mesh_file->bytes / 2 * sizeof(BlockCover::Rectangle) : 0;
  return image * (view.mask_file ? 4 : 3) + depth * sizeof(float) + mesh;
}

}  // namespace

void DropPixels(View& view) {
  view.image = {};
  view.mask = {};
  view.depth = {};
  view.inverse_depth_sigma.reset();
  view.mesh.reset();
}

/// The threads that read; requests go in and views come out under one lock. Where the system
/// rejects threads there are fewer; with none what is asked for is read at once.
class ViewStream::Readers {
 public:
  struct Result {
    size_t slot = 0;
    View view;
    std::string error;  ///< empty: read
  };

  Readers(Loader load, int count) : load_(std::move(load)) {
    try {
      for (int i = 0; i < count; ++i) {
        threads_.emplace_back([this](const std::stop_token& stop) { Run(stop); });
      }
    } catch (const std::system_error&) {
    }
  }

  void Ask(size_t slot, View description) {
    Result request{slot, std::move(description), {}};
    if (threads_.empty()) return Read(std::move(request));
    {
      const std::lock_guard lock(mutex_);
      requests_.push_back(std::move(request));
    }
    asked_.notify_one();
  }

  /// Empties the list of what was read; with `wait` not before there is something.
  std::vector<Result> Take(bool wait) {
    std::unique_lock lock(mutex_);
    if (wait) read_.wait(lock, [this] { return !results_.empty(); });
    return std::exchange(results_, {});
  }

 private:
  void Run(const std::stop_token& stop) {
    const ThreadLimit one(1);  // a view by each reader
    for (;;) {
      std::optional<Result> request;
      {
        std::unique_lock lock(mutex_);
        if (!asked_.wait(lock, stop, [this] { return !requests_.empty(); })) return;
        if (stop.stop_requested()) return;  // what is still asked for is of no use
        request = std::move(requests_.front());
        requests_.pop_front();
      }
      Read(std::move(*request));
    }
  }

  void Read(Result request) {
    try {
      load_(request.view);
      RequireLoaded(request.view);
    } catch (const std::exception& error) {
      request.error = error.what();
    }
    {
      const std::lock_guard lock(mutex_);
      results_.push_back(std::move(request));
    }
    read_.notify_one();
  }

  const Loader load_;
  std::mutex mutex_;
  std::condition_variable_any asked_, read_;
  std::deque<Result> requests_;
  std::vector<Result> results_;
  std::vector<std::jthread> threads_;  // last: they stop before the rest goes
};

ViewStream::ViewStream(DtrSet& set, std::vector<RenderScene> described, Loader load,
                       Settings settings)
    : described_(std::move(described)), settings_(std::move(settings)) {
  if (set.frames.empty() || set.frames.size() != described_.size()) {
    throw std::invalid_argument("ViewStream: expected a scene of every frame");
  }
  for (size_t frame = 0; frame < described_.size(); ++frame) {
    first_slot_.push_back(slots_.size());
    std::vector<View>& views = set.frames[frame].views;
    for (const View* view : described_[frame].views) {
      constexpr std::less<> before;  // of pointers into whatever arrays
      if (before(view, views.data()) || !before(view, views.data() + views.size())) {
        throw std::invalid_argument("ViewStream: a view of another set");
      }
      View& own = views[static_cast<size_t>(view - views.data())];
      slots_.push_back({&own, State::kAbsent, false, BytesOf(own), 0, {}});
    }
  }
  first_slot_.push_back(slots_.size());
  readers_ = std::make_unique<Readers>(std::move(load), ThreadLimit::Current());
}

ViewStream::~ViewStream() = default;

std::vector<size_t> ViewStream::NotLost() const {
  std::vector<size_t> slots;
  for (size_t i = first_slot_[shown_]; i < first_slot_[shown_ + 1]; ++i) {
    if (slots_[i].state != State::kLost && !IsHidden(slots_[i].view)) slots.push_back(i);
  }
  return slots;
}

void ViewStream::RequireAnyReadable() const {
  const auto begin = slots_.begin() + static_cast<std::ptrdiff_t>(first_slot_[shown_]);
  const auto end = slots_.begin() + static_cast<std::ptrdiff_t>(first_slot_[shown_ + 1]);
  const auto lost = [](const Slot& slot) { return slot.state == State::kLost; };
  if (begin == end || !std::all_of(begin, end, lost)) return;
  throw Error("views: expected at least one that can be read, found none; the first: " +
              begin->told);
}

size_t ViewStream::RetryLost(const std::function<bool(const View&)>& may_be_read) {
  return std::erase_if(lost_, [&](const Lost& lost) {
    if (!may_be_read(*lost.view)) return false;
    for (Slot& slot : slots_) {
      if (slot.view == lost.view) slot.state = State::kAbsent;
    }
    return true;
  });
}

void ViewStream::Hide(std::vector<const View*> views) {
  hidden_ = std::move(views);
  std::sort(hidden_.begin(), hidden_.end(), std::less<>());
}

bool ViewStream::IsHidden(const View* view) const {
  return std::binary_search(hidden_.begin(), hidden_.end(), view, std::less<>());
}

RenderScene ViewStream::SceneOf(const std::vector<size_t>& slots) const {
  RenderScene scene = described_.at(shown_);
  scene.views.clear();
  for (const size_t slot : slots) scene.views.push_back(slots_[slot].view);
  return scene;
}

ViewStream::Needed ViewStream::NeededFor(const Pose& novel_from_world,
                                         const RenderOptions& options) const {
  const std::vector<size_t> candidates = NotLost();
  RenderScene scene = SceneOf(candidates);
  // From all views: what was lost so far may depend on what was read ahead.
  RenderScene all = described_.at(shown_);
  std::erase_if(all.views, [this](const View* view) { return IsHidden(view); });
  scene.per_pixel = NeedsPerPixelRule(all, novel_from_world);
  const ViewSelection selection = SelectViews(scene, novel_from_world, options);
  Needed needed{{}, selection.per_pixel, selection.views.size()};
  size_t bytes = 0;
  for (const int index : selection.views) {
    const size_t slot = candidates[static_cast<size_t>(index)];
    bytes += slots_[slot].bytes;
    if (bytes > settings_.host_bytes && !needed.slots.empty()) break;
    needed.slots.push_back(slot);
  }
  return needed;
}

std::vector<ViewStream::Slot*> ViewStream::Droppable() {
  std::vector<Slot*> slots;
  for (Slot& slot : slots_) {
    if (slot.state == State::kPresent && slot.last_used != now_) slots.push_back(&slot);
  }
  std::sort(slots.begin(), slots.end(), [](const Slot* a, const Slot* b) {
    return std::tie(a->last_used, a) > std::tie(b->last_used, b);
  });
  return slots;
}

bool ViewStream::MakeRoom(size_t bytes, std::optional<std::vector<Slot*>>& droppable) {
  while (bytes_ + bytes > settings_.host_bytes) {
    if (!droppable) droppable = Droppable();
    if (droppable->empty()) return bytes_ == 0;  // one view is kept, however large
    Slot& oldest = *droppable->back();
    droppable->pop_back();
    DropPixels(*oldest.view);
    oldest.state = State::kAbsent;
    bytes_ -= oldest.bytes;
  }
  return true;
}

bool ViewStream::IsThere(size_t slot, Pixels pixels) const {
  return slots_[slot].state == State::kPresent ||
         (slots_[slot].released && pixels == Pixels::kOrReleased);
}

void ViewStream::Release(const View& view) {
  const auto slot = std::find_if(slots_.begin(), slots_.end(),
                                 [&](const Slot& candidate) { return candidate.view == &view; });
  if (slot == slots_.end() || slot->state != State::kPresent) return;
  DropPixels(*slot->view);
  slot->state = State::kAbsent;
  slot->released = true;
  bytes_ -= slot->bytes;
}

size_t ViewStream::decoded_bytes() const {
  size_t bytes = bytes_;
  for (const Slot& slot : slots_) {
    if (slot.released && slot.state == State::kAbsent) bytes += slot.bytes;
  }
  return bytes;
}

void ViewStream::Request(const std::vector<size_t>& slots, Pixels pixels) {
  std::optional<std::vector<Slot*>> droppable;
  for (const size_t index : slots) {
    Slot& slot = slots_[index];
    if (slot.state != State::kAbsent || IsThere(index, pixels)) continue;
    if (!MakeRoom(slot.bytes, droppable)) return;
    slot.state = State::kReading;
    bytes_ += slot.bytes;
    ++reading_;
    readers_->Ask(index, *slot.view);
  }
}

void ViewStream::Collect(bool wait) {
  for (Readers::Result& result : readers_->Take(wait)) {
    Slot& slot = slots_[result.slot];
    --reading_;
    slot.released = false;
    if (result.error.empty()) {
      slot.view->image = std::move(result.view.image);
      slot.view->mask = std::move(result.view.mask);
      slot.view->depth = std::move(result.view.depth);
      slot.view->inverse_depth_sigma = std::move(result.view.inverse_depth_sigma);
      slot.view->mesh = std::move(result.view.mesh);
      slot.state = State::kPresent;
      continue;
    }
    slot.state = State::kLost;
    bytes_ -= slot.bytes;
    lost_.push_back({slot.view->name, result.error, slot.view});
    if (std::exchange(slot.told, result.error) == result.error) continue;
    settings_.warn("WARNING: " + slot.view->name + " is left out: " + result.error);
  }
}

void ViewStream::WarnOfRoom(size_t fitting, size_t wanted) {
  if (std::exchange(warned_of_room_, true)) return;
  settings_.warn("WARNING: drawn from the nearest " + std::to_string(fitting) + " of " +
                 std::to_string(wanted) + " views: more do not fit into " +
                 GigabytesText(settings_.host_bytes) + " GB of memory; give `memory`");
}

RenderScene ViewStream::SceneFor(const Pose& novel_from_world, const RenderOptions& options,
                                 Wait wait, Pixels pixels) {
  Collect(false);
  Needed needed;
  for (std::optional<size_t> lost;;) {
    ++now_;
    if (lost != lost_.size()) {  // a view that turned out lost makes room for another
      RequireAnyReadable();
      needed = NeededFor(novel_from_world, options);
      lost = lost_.size();
    }
    for (const size_t slot : needed.slots) slots_[slot].last_used = now_;
    if (pixels == Pixels::kInMemory &&
        std::any_of(needed.slots.begin(), needed.slots.end(),
                    [this](size_t slot) { return slots_[slot].released; })) {
      wait = Wait::kForAll;
    }
    Request(needed.slots, pixels);
    const auto there = [&](size_t slot) { return IsThere(slot, pixels); };
    if (wait == Wait::kForNone || std::all_of(needed.slots.begin(), needed.slots.end(), there)) {
      break;
    }
    // Needed views fit in memory once nothing else does: what is missing is being read, or waits
    // for the room of an earlier request.
    assert(reading_ > 0);
    // Not for each of many alone: all are looked through again.
    for (const int enough = reading_ / 2; reading_ > enough;) Collect(true);
  }
  const bool all_fit = needed.slots.size() == needed.wanted;
  if (!all_fit) WarnOfRoom(needed.slots.size(), needed.wanted);
  std::vector<size_t> drawn = NotLost();
  if (wait == Wait::kForNone) {
    std::erase_if(drawn, [&](size_t slot) { return !IsThere(slot, pixels); });
  } else if (!all_fit && needed.per_pixel) {
    drawn = needed.slots;
    std::sort(drawn.begin(), drawn.end());
  }
  RenderScene scene = SceneOf(drawn);
  if (!all_fit && wait == Wait::kForAll) scene.max_views = needed.slots.size();
  scene.per_pixel = needed.per_pixel;
  return scene;
}

void ViewStream::Prefetch(const Pose& novel_from_world, const RenderOptions& options,
                          Pixels pixels) {
  Collect(false);
  const Needed needed = NeededFor(novel_from_world, options);
  for (const size_t slot : needed.slots) slots_[slot].last_used = now_;  // not for each other
  Request(needed.slots, pixels);
}

}  // namespace dtr
