#include "stereo/complete/complete.h"

#include <algorithm>
#include <atomic>

#include "dtr/base/parallel_for.h"
#include "stereo/complete/outline_planes.h"
#include "stereo/complete/scene_planes.h"

namespace dtr::stereo {
namespace {

constexpr int kPasses = 2;
constexpr int kMeasuredPlanes = 12;  // that are looked for: their normals lead the sweep
constexpr int kLargestPlanes = 3;    // of these, that cells choose among
constexpr int kSweptPlanes = 2;

/// A view's neighbours, and what an earlier pass gave for them.
struct Around {
  std::vector<const CellView*> cells;
  std::vector<const CompletedCells*> completed;
};

Around AroundOf(std::span<const CellView> views, const std::vector<int>& neighbours,
                std::span<const CompletedCells> completed) {
  Around around;
  for (const int n : neighbours) {
    around.cells.push_back(&views[static_cast<size_t>(n)]);
    if (!completed.empty()) around.completed.push_back(&completed[static_cast<size_t>(n)]);
  }
  return around;
}

}  // namespace

std::vector<ScenePlane> PlanesToChoose(std::span<const CellView> views,
                                       std::span<const std::vector<int>> neighbours) {
  std::vector<ScenePlane> planes = FindScenePlanes(views, kMeasuredPlanes);
  std::vector<Neighbourhood> around;
  for (size_t i = 0; i < views.size(); ++i) {
    around.push_back({&views[i], AroundOf(views, neighbours[i], {}).cells});
  }
  const auto swept = SweepScenePlanes(around, planes, kSweptPlanes);
  planes.resize(std::min<size_t>(planes.size(), kLargestPlanes));
  planes.insert(planes.end(), swept.begin(), swept.end());
  return planes;
}

std::vector<CompletedCells> CompleteCells(std::span<const CellView> views,
                                          std::span<const std::vector<int>> neighbours,
                                          std::span<const ScenePlane> planes, int at_once,
                                          Progress& progress) {
  const int count = static_cast<int>(views.size());
  progress.Stage("completion", (1 + kPasses) * count);
  std::atomic<int> done = 0;
  std::vector<Grid<float>> by_outline(views.size());
  ParallelFor(0, count, at_once, [&](int i) {
    progress.ThrowIfInterrupted();
    const auto v = static_cast<size_t>(i);
    by_outline[v] = OutlinePlanes(views[v], AroundOf(views, neighbours[v], {}).cells, planes);
    progress.Update(++done);
  });
  std::vector<CompletedCells> completed;
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<CompletedCells> next(views.size());
    ParallelFor(0, count, at_once, [&](int i) {
      progress.ThrowIfInterrupted();
      const auto v = static_cast<size_t>(i);
      const Around around = AroundOf(views, neighbours[v], completed);
      next[v] = LabelCells(views[v], around.cells, around.completed, planes, by_outline[v], {});
      progress.Update(++done);
    });
    completed = std::move(next);
  }
  return completed;
}

CompletionMemory CompletionMemoryOf(std::span<const PinholeCamera> cameras) {
  constexpr double kLabels = kOwnLabels + kLargestPlanes + kSweptPlanes;
  CompletionMemory memory;
  for (const PinholeCamera& camera : cameras) {
    const auto cells = static_cast<double>(CellBytes(camera));
    memory.cells_bytes += 2.5 * cells;  // with the planes of two passes and of outlines
    // Of each label a plane and two costs: 20 bytes, where a cell has 30.
    memory.view_bytes = std::max(memory.view_bytes, cells * kLabels);
  }
  return memory;
}

}  // namespace dtr::stereo
