// CompleteDepth of finishing.h.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "dtr/types/inverse_depth_code.h"
#include "pipeline/core/depth/source_scene.h"
#include "pipeline/core/run/finishing.h"
#include "stereo/complete/complete.h"
#include "stereo/complete/expand.h"

namespace dtr::pipeline {
namespace {

constexpr int kNeighbours = 8;
constexpr double kFarthest = 50;       // times the farthest measured depth: drawn behind everything
constexpr double kStepPx = 0.5;        // pixels of disparity between depths that are stored
constexpr double kLeastRoomGb = 0.01;  // a view at a time

double NearestOf(const DepthImage& completed, double far_z) {
  double near_z = far_z / 2;
  for (const float z : completed.grid().data()) {
    if (z > 0) near_z = std::min(near_z, static_cast<double>(z));
  }
  return near_z;
}

/// The range of what was completed, and steps that do not show.
void ChooseCoding(double near_z, double far_z, View& view) {
  view.completed_near_z = near_z;
  view.completed_far_z = far_z;
  const double steps = (1 / near_z - 1 / far_z) / (kStepPx * ThresholdsOf(view, {}).pixel);
  view.completed_steps =
      static_cast<int>(std::clamp<double>(std::ceil(steps), 1, InverseDepthCode::kSteps));
}

/// Puts depths nearer than `below_z` into the view's holes.
void Fill(const DepthImage& known, float below_z, View& view) {
  for (size_t p = 0; p < known.grid().data().size(); ++p) {
    const float z = known.grid().data()[p];
    if (!DepthImage::IsHole(z) && z < below_z) view.depth.grid().data()[p] = z;
  }
}

/// Views that are completed at a time, at least one. The result does not depend on it.
int ViewsAtOnce(double room_bytes, double view_bytes) {
  const double at_once = (room_bytes - kAlwaysAllowedBytes) / view_bytes;
  return static_cast<int>(std::clamp<double>(at_once, 1, ThreadLimit::Current()));
}

/// Of one view, from the planes of its cells; sets its coding.
DepthImage Completed(const stereo::CellView& cells, const stereo::CompletedCells& completed,
                     float far_z, View loaded, size_t index, const KnownCompletion& known,
                     View& view) {
  if (!known.depth) {
    DepthImage depth = stereo::ExpandCells(loaded, cells, completed, far_z);
    ChooseCoding(NearestOf(depth, static_cast<double>(far_z)), static_cast<double>(far_z), view);
    return depth;
  }
  const DepthImage before = known.depth(index, loaded);
  Fill(before, std::numeric_limits<float>::infinity(), loaded);
  DepthImage depth = stereo::ExpandCells(loaded, cells, completed, far_z);
  const double near_z = known.near_z(index);
  for (size_t p = 0; p < before.grid().data().size(); ++p) {
    float& z = depth.grid().data()[p];
    if (DepthImage::IsHole(z)) z = before.grid().data()[p];
    if (!DepthImage::IsHole(z)) z = std::clamp(z, static_cast<float>(near_z), far_z);
  }
  ChooseCoding(near_z, static_cast<double>(far_z), view);
  return depth;
}

}  // namespace

std::vector<stereo::ScenePlane> CompleteDepth(DtrSet& set, const SparseScene& sparse,
                                              io::SetWriter& writer, double memory_gb,
                                              Progress& progress, const KnownCompletion& known) {
  std::vector<View>& views = set.frames.front().views;
  const std::vector<int> sources = ViewsWithDepth(views);
  std::vector<PinholeCamera> cameras;
  double farthest = 0;
  for (const int source : sources) {
    const View& view = views[static_cast<size_t>(source)];
    cameras.push_back(view.camera);
    farthest = std::max(farthest, view.far_z);
  }
  const stereo::CompletionMemory needed = stereo::CompletionMemoryOf(cameras);
  const double room_bytes = memory_gb * kBytesPerGigabyte - needed.cells_bytes;
  if (room_bytes < needed.view_bytes) {
    progress.Note(fmt::format(
        "depth is not completed where none was measured: that takes `memory` {:.3f} (GB)",
        (needed.cells_bytes + needed.view_bytes) / kBytesPerGigabyte));
    return {};
  }
  const auto far_z = static_cast<float>(kFarthest * farthest);
  // Beside the cells, which stay until the end.
  const double beside_gb = std::max(room_bytes / kBytesPerGigabyte, kLeastRoomGb);
  std::vector<stereo::CellView> cells(sources.size());
  ForViews(views, sources, "", beside_gb, progress, [&](size_t k) {
    const auto v = static_cast<size_t>(sources[k]);
    View view = Loaded(views[v], writer.folder());
    // What is far is no surface that goes on.
    if (known.depth) Fill(known.depth(v, view), far_z, view);
    cells[k] = stereo::MakeCells(view);
  });
  const bool measured = std::ranges::any_of(cells, [](const stereo::CellView& of_view) {
    return std::ranges::any_of(of_view.inverse_depth.data(), [](float w) { return w > 0; });
  });
  if (!measured) {
    progress.Note("depth is not completed: none was measured");
    return {};
  }
  const auto neighbours =
      NeighboursOf(views, sources, SourceScene(sparse, views, sources), kNeighbours);
  const std::vector<stereo::ScenePlane> planes =
      known.depth ? known.planes : stereo::PlanesToChoose(cells, neighbours);
  const auto completed = stereo::CompleteCells(
      cells, neighbours, planes, ViewsAtOnce(room_bytes, needed.view_bytes), progress);
  ForViews(views, sources, "completed depth", beside_gb, progress, [&](size_t k) {
    const auto v = static_cast<size_t>(sources[k]);
    const DepthImage depth = Completed(cells[k], completed[k], far_z,
                                       Loaded(views[v], writer.folder()), v, known, views[v]);
    writer.WriteCompleted(depth, views[v]);
  });
  return planes;
}

}  // namespace dtr::pipeline
