// stereo/side_by_side.h -- several views at a time, within the run's memory.
#pragma once
#include <functional>
#include <span>
#include <string>

#include "dtr/base/progress.h"
#include "stereo/geometric_passes.h"

namespace dtr::stereo {

/// How many of these views may be worked on at the same time, on as many threads: each within its
/// LeastBytes, all within the limit of the pages. 1 where the engine does not say what it takes.
int ViewsAtOnce(const Collection& collection, std::span<const int> views, bool filters);

/// Calls `body(k, &note)` for every k in [0, count), so many at a time, and counts them in the
/// stage that runs. The notes are passed on in their order once all are done; Interrupted between
/// items.
void SideBySide(size_t count, int at_once, Progress& progress,
                const std::function<void(size_t k, std::string* note)>& body);

}  // namespace dtr::stereo
