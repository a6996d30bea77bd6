// stereo/complete/complete.h -- depth for what no view measured, decided once for a whole set.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "dtr/base/progress.h"
#include "stereo/complete/cells.h"
#include "stereo/complete/label_cells.h"
#include "stereo/complete/scene_planes.h"

namespace dtr::stereo {

/// The planes of the scene that cells without a measured surface choose among (docs/METHODS.md,
/// 11.1): the largest measured ones, and those that a sweep finds. `neighbours`: of each view,
/// indices of others, best first. Deterministic for any number of threads.
std::vector<ScenePlane> PlanesToChoose(std::span<const CellView> views,
                                       std::span<const std::vector<int>> neighbours);

/// Planes for all cells of all views (docs/METHODS.md, 11.1): measured surfaces that go on, those
/// of other views, `planes` of the scene, or infinitely far, whichever the photos agree on, in two
/// passes: the second holds each view to what the others chose. `neighbours`: as above.
/// `at_once`: views that memory has room for at a time. Deterministic for any number of threads.
/// Throws Interrupted between views.
std::vector<CompletedCells> CompleteCells(std::span<const CellView> views,
                                          std::span<const std::vector<int>> neighbours,
                                          std::span<const ScenePlane> planes, int at_once,
                                          Progress& progress);

/// Memory of CompleteCells for views of these cameras, at most.
struct CompletionMemory {
  double cells_bytes = 0;  ///< of all views, with their cells
  double view_bytes = 0;   ///< beside, for each view being completed
};
CompletionMemory CompletionMemoryOf(std::span<const PinholeCamera> cameras);

}  // namespace dtr::stereo
