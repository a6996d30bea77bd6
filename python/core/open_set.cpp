#include "python/core/open_set.h"

#include <algorithm>
#include <atomic>
#include <utility>

#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"

namespace dtr::python {
namespace {

size_t ViewsOf(const DtrSet& set) {
  size_t count = 0;
  for (const Frame& frame : set.frames) count += frame.views.size();
  return count;
}

/// The view with the pixels of one plane, and no others.
View ReadPlane(const std::filesystem::path& folder, View view, Plane plane) {
  io::LoadOptions load;
  load.images = plane == Plane::kImage || plane == Plane::kMask;
  load.depth = plane == Plane::kDepth || plane == Plane::kCompletedDepth;
  load.completed = plane == Plane::kCompletedDepth;
  load.sigma = plane == Plane::kSigma;
  if (plane != Plane::kImage) view.image_file.reset();
  if (plane != Plane::kMask) view.mask_file.reset();
  view.mesh_file.reset();  // for renderers alone
  io::LoadPixels(folder, view, load);
  return view;
}

template <typename T>
std::shared_ptr<const Grid<T>> Shared(Grid<T> grid) {
  if (grid.empty()) return nullptr;
  return std::make_shared<const Grid<T>>(std::move(grid));
}

Floats FloatsIn(View view, Plane plane) {
  switch (plane) {
    case Plane::kDepth:
      return Shared(std::move(view.depth.grid()));
    case Plane::kCompletedDepth:
      return Shared(std::move(CompletedDepth(view).grid()));
    default:
      return view.inverse_depth_sigma ? Shared(std::move(*view.inverse_depth_sigma)) : nullptr;
  }
}

}  // namespace

OpenSet::OpenSet(std::filesystem::path folder)
    : folder_(std::move(folder)), set_(io::ReadSet(folder_)), slots_(ViewsOf(set_)) {
  size_t next = 0;
  for (const Frame& frame : set_.frames) {
    first_slot_.push_back(next);
    next += frame.views.size();
  }
}

Bytes OpenSet::BytesOf(ViewPlace at, Plane plane) {
  Slot& slot = SlotOf(at);
  const std::lock_guard lock(slot.mutex);
  Cell<Bytes>& cell = plane == Plane::kImage ? slot.image : slot.mask;
  if (!cell.read) {
    View read = ReadPlane(folder_, view(at), plane);
    cell.pixels = Shared(std::move(plane == Plane::kImage ? read.image : read.mask));
    cell.read = true;
  }
  return cell.pixels;
}

Floats OpenSet::FloatsOf(ViewPlace at, Plane plane) {
  Slot& slot = SlotOf(at);
  const std::lock_guard lock(slot.mutex);
  Cell<Floats>& cell = plane == Plane::kDepth            ? slot.depth
                       : plane == Plane::kCompletedDepth ? slot.completed
                                                         : slot.sigma;
  if (!cell.read) {
    View read = ReadPlane(folder_, view(at), plane);
    if (plane == Plane::kCompletedDepth && !slot.depth.read) {  // both were decoded
      slot.depth = {true, Shared(std::move(MeasuredDepth(read).grid()))};
    }
    cell.pixels = FloatsIn(std::move(read), plane);
    cell.read = true;
  }
  return cell.pixels;
}

void OpenSet::Load(std::vector<Plane> planes, Progress& progress) {
  // With completed depth comes the measured one.
  std::stable_partition(planes.begin(), planes.end(),
                        [](Plane plane) { return plane == Plane::kCompletedDepth; });
  std::vector<ViewPlace> places;
  for (size_t step = 0; step < set_.frames.size(); ++step) {
    for (size_t i = 0; i < set_.frames[step].views.size(); ++i) places.push_back({step, i});
  }
  progress.Stage("reading pixels", static_cast<int>(places.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(places.size()), [&](int i) {
    progress.ThrowIfInterrupted();
    for (const Plane plane : planes) {
      const ViewPlace at = places[static_cast<size_t>(i)];
      if (plane == Plane::kImage || plane == Plane::kMask) {
        BytesOf(at, plane);
      } else {
        FloatsOf(at, plane);
      }
    }
    progress.Update(++done);
  });
}

void OpenSet::DropPixels() {
  for (Slot& slot : slots_) {
    const std::lock_guard lock(slot.mutex);
    slot.image = slot.mask = {};
    slot.depth = slot.completed = slot.sigma = {};
  }
}

}  // namespace dtr::python
