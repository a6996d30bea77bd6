// dtr/render/view_stream.h -- the pixels of a set that may be larger than memory: read in the
// background when an image needs them, dropped when others need the room.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/scene.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/pose.h"

namespace dtr {

/// Frees the pixels of a view, and what was made of them; its description stays.
void DropPixels(View& view);

/// Keeps the pixels of the source views that images are drawn from, those used last, within a
/// number of bytes. All members belong to one thread; reading runs on others, which see copies of
/// the views only, so that the pixels of a view change inside calls of this class and nowhere else.
/// What a waiting call gives depends on the set, the camera, the options and the bytes alone.
class ViewStream {
 public:
  /// Reads image, mask and depth of a view that is described; throws dtr::Error where it cannot.
  /// Called on several threads at once.
  using Loader = std::function<void(View&)>;

  struct Settings {
    size_t host_bytes = 4'000'000'000;  ///< pixels in memory; one view is always kept
    std::function<void(const std::string&)> warn = [](const std::string&) {};
  };

  enum class Wait {
    kForAll,   ///< still frames: until every view that the image needs is there or lost
    kForNone,  ///< moving images: what is there, and the rest is asked for
  };

  /// What images are drawn from.
  enum class Pixels {
    kInMemory,    ///< views whose pixels are there
    kOrReleased,  ///< and those whose pixels were released, for a renderer that holds what it needs
  };

  /// A view that could not be read: it is not drawn from again unless RetryLost says so.
  struct Lost {
    std::string name, reason;
    const View* view = nullptr;
  };

  /// `set` is as io::ReadSet gives it, without pixels; `described` is DescribeRenderScene of it, or
  /// of a dynamic set DescribeFrames. Both outlive the stream, and the views stay where they are.
  ViewStream(DtrSet& set, std::vector<RenderScene> described, Loader load, Settings settings);
  ViewStream(DtrSet& set, RenderScene described, Loader load, Settings settings)
      : ViewStream(set, std::vector<RenderScene>{std::move(described)}, std::move(load),
                   std::move(settings)) {}
  /// Waits for what is being read just now.
  ~ViewStream();
  ViewStream(const ViewStream&) = delete;
  ViewStream& operator=(const ViewStream&) = delete;

  /// The scene to draw an image of this camera from: SelectViews of it names only views whose
  /// pixels are in memory. They stay there until the next call. Released pixels that it needs are
  /// waited for, whatever `wait` says: a moving image would lose what it had. Where the bytes do
  /// not hold all that the image needs, the nearest that fit are drawn from, which is said once.
  /// A view that cannot be read is left out, which is said, and another takes its place. Throws
  /// dtr::Error when no view of the set can be read.
  RenderScene SceneFor(const Pose& novel_from_world, const RenderOptions& options, Wait wait,
                       Pixels pixels = Pixels::kInMemory);

  /// Begins to read what a later image needs, as far as there is room beside the last one's.
  void Prefetch(const Pose& novel_from_world, const RenderOptions& options,
                Pixels pixels = Pixels::kInMemory);

  /// Of a dynamic set: images are of this frame until the next call; at first of frame 0. All
  /// frames share the bytes.
  void ShowFrame(size_t frame) { shown_ = frame; }

  /// Drops the pixels of a view that is in memory: a renderer made its own of them. They are read
  /// again when an image needs them itself.
  void Release(const View& view);

  /// Leaves out these views (pointers into the set), as --exclude does, until the next call.
  void Hide(std::vector<const View*> views);

  /// Lost views for which this says yes are tried again when an image needs them: files come back.
  /// Returns how many. One that fails again for the same reason is not warned of again.
  size_t RetryLost(const std::function<bool(const View&)>& may_be_read);

  /// Of all frames.
  const std::vector<Lost>& lost() const { return lost_; }
  /// Pixels in memory or being read.
  size_t bytes() const { return bytes_; }
  /// The same with the pixels that were released: what the views drawn from take, decoded.
  size_t decoded_bytes() const;
  /// Views that are being read, as of the last call of SceneFor or Prefetch.
  int reading() const { return reading_; }

 private:
  enum class State { kAbsent, kReading, kPresent, kLost };
  struct Slot {
    View* view = nullptr;
    State state = State::kAbsent;
    bool released = false;        ///< a renderer holds what it made of pixels that are not there
    size_t bytes = 0;             ///< its pixels, from its description
    std::uint64_t last_used = 0;  ///< number of the call that needed it last
    std::string told;             ///< why it was lost, as warned of last
  };
  class Readers;

  /// Indices into slots_ of what the image needs, nearest first, as many as the bytes hold.
  struct Needed {
    std::vector<size_t> slots;
    bool per_pixel = false;
    size_t wanted = 0;  ///< what SelectViews asks for
  };
  Needed NeededFor(const Pose& novel_from_world, const RenderOptions& options) const;
  RenderScene SceneOf(const std::vector<size_t>& slots) const;
  std::vector<size_t> NotLost() const;  ///< nor hidden; of the shown frame
  void RequireAnyReadable() const;
  bool IsHidden(const View* view) const;
  /// Asks for the absent ones of these, as far as dropping others gives room.
  void Request(const std::vector<size_t>& slots, Pixels pixels);
  bool IsThere(size_t slot, Pixels pixels) const;
  /// In memory and not needed now, the one used longest ago last.
  std::vector<Slot*> Droppable();
  /// Drops what is Droppable, which it fills in once for all calls of one request.
  bool MakeRoom(size_t bytes, std::optional<std::vector<Slot*>>& droppable);
  /// Takes over what was read; waits for at least one when `wait`.
  void Collect(bool wait);
  void WarnOfRoom(size_t fitting, size_t wanted);

  const std::vector<RenderScene> described_;  ///< by frame
  const Settings settings_;
  std::vector<Slot> slots_;         ///< as the frames' views, one frame after the other
  std::vector<size_t> first_slot_;  ///< of each frame, and of one more
  size_t shown_ = 0;                ///< frame
  std::vector<Lost> lost_;
  std::vector<const View*> hidden_;  ///< sorted
  size_t bytes_ = 0;
  int reading_ = 0;
  std::uint64_t now_ = 0;  ///< number of this call
  bool warned_of_room_ = false;
  std::unique_ptr<Readers> readers_;
};

}  // namespace dtr
