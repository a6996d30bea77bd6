#include "pipeline/boards/detail/sensor_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "calib/solve/rotated_views.h"
#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

using Size = std::pair<int, int>;

Size SizeOf(const StoredView& stored) { return {stored.width_px, stored.height_px}; }
Size Swapped(const Size& size) { return {size.second, size.first}; }
Size Landscape(const Size& size) { return std::max(size, Swapped(size)); }

// Of equally frequent sizes the larger.
Size UsualSize(const std::vector<StoredView>& all) {
  std::map<Size, int> counts, of_either_shape;
  for (const StoredView& stored : all) {
    ++counts[SizeOf(stored)];
    ++of_either_shape[Landscape(SizeOf(stored))];
  }
  Size usual;
  int most = 0;
  for (const auto& [size, count] : of_either_shape) {
    if (count < most) continue;
    usual = size;
    most = count;
  }
  return counts[Swapped(usual)] > counts[usual] ? Swapped(usual) : usual;
}

Size GridOf(const std::vector<StoredView>& all, const std::optional<calib::LensCamera>& known) {
  if (known) {
    const Size size{known->width_px, known->height_px};
    const bool any = std::any_of(all.begin(), all.end(), [&](const StoredView& stored) {
      return Landscape(SizeOf(stored)) == Landscape(size);
    });
    if (any) return size;
  }
  return UsualSize(all);
}

std::vector<calib::FoundRotation> RotationsOf(const calib::Board& board,
                                              const std::vector<calib::BoardView>& as_grid,
                                              const std::vector<calib::BoardView>& rotated,
                                              const Size& grid,
                                              const std::optional<calib::LensCamera>& known) {
  if (rotated.empty()) return {};
  const bool usable = known && Size{known->width_px, known->height_px} == grid;
  try {
    return calib::FindRotations(
        board, rotated,
        usable ? calib::ReferenceCamera{*known, {}}
               : calib::ReferenceFrom(board, as_grid, grid.first, grid.second));
  } catch (const Error& error) {
    const std::string why =
        fmt::format("the other photos determine no camera to compare with ({})", error.what());
    return std::vector<calib::FoundRotation>(rotated.size(), {calib::PhotoRotation::kNone, why});
  }
}

std::string RotatedPhotos(size_t count) {
  return fmt::format("{} photo{} that a program had rotated", count, count == 1 ? "" : "s");
}

// Also of what cannot be put back: where too few are left to calibrate, no list of them is printed.
void ReportRotated(const std::string& name, const calib::RotationCounts& counts,
                   const std::vector<calib::LeftOut>& undecided, const Size& grid,
                   Progress& progress) {
  const int back = counts.clockwise + counts.counterclockwise;
  if (back > 0) {
    progress.Note(fmt::format(
        "{}: {}, {} clockwise and {} counterclockwise: corners put back on the sensor's grid of {} "
        "x {} px",
        name, RotatedPhotos(static_cast<size_t>(back)), counts.clockwise, counts.counterclockwise,
        grid.first, grid.second));
  }
  if (!undecided.empty()) {
    progress.Note(fmt::format("{}: {} left out; {}: {}", name, RotatedPhotos(undecided.size()),
                              undecided.front().name, undecided.front().reason));
  }
}

}  // namespace

ViewsOnGrid OnOneGrid(const calib::Board& board, std::vector<StoredView> stored,
                      const std::string& name, const std::optional<calib::LensCamera>& known,
                      Progress& progress) {
  const Size grid = GridOf(stored, known);
  std::vector<calib::BoardView> as_grid, rotated;
  for (const StoredView& item : stored) {
    if (SizeOf(item) == grid) {
      as_grid.push_back(item.view);
    } else if (SizeOf(item) == Swapped(grid)) {
      rotated.push_back(item.view);
    }
  }
  const auto rotations = RotationsOf(board, as_grid, rotated, grid, known);
  ViewsOnGrid on_grid{grid.first, grid.second, {}, {}};
  calib::RotationCounts counts;
  std::vector<calib::LeftOut> undecided;
  size_t next = 0;  // of rotated
  for (StoredView& item : stored) {
    if (SizeOf(item) == grid) {
      on_grid.views.push_back(std::move(item.view));
    } else if (SizeOf(item) != Swapped(grid)) {
      on_grid.left_out.push_back(
          {item.view.name,
           fmt::format("its size, {} x {} px, is not that of the others, {} x {} px", item.width_px,
                       item.height_px, grid.first, grid.second)});
    } else if (const calib::FoundRotation& found = rotations[next++]; found.undecided.empty()) {
      on_grid.views.push_back(
          calib::OnSensorGrid(item.view, found.rotation, grid.first, grid.second));
      counts.Add(found.rotation);
    } else {
      undecided.push_back(
          {item.view.name,
           fmt::format("its {} x {} px are rotated against the {} x {} px of the camera, and which "
                       "way cannot be found: {}; use the photo as the camera stored it",
                       item.width_px, item.height_px, grid.first, grid.second, found.undecided)});
    }
  }
  ReportRotated(name, counts, undecided, grid, progress);
  on_grid.left_out.insert(on_grid.left_out.end(), undecided.begin(), undecided.end());
  return on_grid;
}

}  // namespace dtr::pipeline
