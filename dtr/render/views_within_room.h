// dtr/render/views_within_room.h -- what a renderer prepared of its views, within a number of
// bytes.
#pragma once
#include <cstddef>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dtr/render/frame.h"

namespace dtr {

/// Caches what frames are drawn from; the views used longest ago make room. A renderer says what
/// that is and how large.
class ViewsWithinRoom {
 public:
  explicit ViewsWithinRoom(size_t room_bytes) : room_bytes_(room_bytes) {}
  virtual ~ViewsWithinRoom() = default;
  ViewsWithinRoom(const ViewsWithinRoom&) = delete;
  ViewsWithinRoom& operator=(const ViewsWithinRoom&) = delete;

  /// Prepares the frame's views, nearest first; those that do not fit beside nearer ones leave the
  /// frame (at least one view stays). This depends on the views and the bytes alone, not on what
  /// was drawn before. While a view is prepared, it may lie beside as much as fits. Returns how
  /// many views fit.
  size_t Prepare(RenderFrame& frame, const std::vector<const View*>& nearest_first);

  size_t bytes() const { return bytes_; }
  /// True when all of the frame's views fit, whatever they look like: none makes room for another.
  bool AllFit(const RenderFrame& frame) const;
  void Clear();

 protected:
  size_t room_bytes() const { return room_bytes_; }

  /// Called before anything is prepared for a frame.
  virtual void Begin(const RenderFrame&) {}
  /// Prepares what is missing of these views, on all cores.
  virtual void Put(const RenderFrame& frame, const std::vector<const View*>& views) = 0;
  /// Drops what this frame does not draw of the view.
  virtual void DropUnused(const RenderFrame&, const View&) {}
  virtual void DropView(const View& view) = 0;
  virtual void DropAll() = 0;
  virtual size_t BytesOf(const View& view) const = 0;
  /// Sum over the frame's views of at least what each takes.
  virtual size_t MostBytesOf(const RenderFrame& frame) const = 0;

 private:
  struct Used {
    size_t bytes = 0;
    std::uint64_t last = 0;  ///< number of the frame; odd: a frame will use it again
  };

  size_t PrepareWithinRoom(RenderFrame& frame, const std::vector<const View*>& nearest_first);
  void PutAndCount(const RenderFrame& frame, const std::vector<const View*>& views);
  void DropUnusedAndCount(const RenderFrame& frame, const View& view);
  bool DropOldest();
  void Drop(const View& view);
  void Count(const View& view, const Used& use);

  const size_t room_bytes_;
  std::unordered_map<const View*, Used> used_;  ///< the views that something was prepared of
  std::set<std::pair<std::uint64_t, const View*>> by_age_;  ///< the same by Used::last
  size_t bytes_ = 0;                                        ///< of them all
  std::uint64_t now_ = 0;
};

}  // namespace dtr
