// python/core/open_set.h -- a set on disk whose pixels are read when somebody asks for them.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"

namespace dtr::python {

/// What a view has one of per pixel.
enum class Plane {
  kImage,           ///< View::image
  kMask,            ///< View::mask
  kDepth,           ///< MeasuredDepth
  kCompletedDepth,  ///< CompletedDepth
  kSigma,           ///< View::inverse_depth_sigma
};

/// Which view: of what time step, and of the views that io::ReadSet gives it.
struct ViewPlace {
  size_t time_step = 0, view = 0;
};

/// Pixels that were read; they live as long as anybody has them, whatever becomes of the set.
using Bytes = std::shared_ptr<const Grid<std::uint8_t>>;
using Floats = std::shared_ptr<const Grid<float>>;

/// Every member may be called from several threads at once.
class OpenSet {
 public:
  /// Reads set.json. Throws as io::ReadSet.
  explicit OpenSet(std::filesystem::path folder);

  const std::filesystem::path& folder() const { return folder_; }
  const DtrSet& set() const { return set_; }
  const View& view(ViewPlace at) const { return set_.frames[at.time_step].views[at.view]; }

  /// kImage or kMask; null where the view has none. Read once and kept: later calls give the same.
  /// Throws as io::LoadPixels.
  Bytes BytesOf(ViewPlace at, Plane plane);
  /// kDepth, kCompletedDepth or kSigma.
  Floats FloatsOf(ViewPlace at, Plane plane);

  /// Reads these planes of every view that are not there yet.
  /// Throws Interrupted where `progress` asks for it.
  void Load(std::vector<Plane> planes, Progress& progress);

  /// Forgets all pixels; those that somebody else still has stay with them.
  void DropPixels();

 private:
  template <typename Pixels>
  struct Cell {
    bool read = false;
    Pixels pixels;
  };
  struct Slot {
    std::mutex mutex;
    Cell<Bytes> image, mask;
    Cell<Floats> depth, completed, sigma;
  };
  Slot& SlotOf(ViewPlace at) { return slots_[first_slot_[at.time_step] + at.view]; }

  const std::filesystem::path folder_;
  const DtrSet set_;
  std::vector<size_t> first_slot_;  // of each time step
  std::vector<Slot> slots_;
};

}  // namespace dtr::python
