// dtr/base/counted_for.h -- a parallel loop that its user can see and stop.
#pragma once
#include <functional>

#include "dtr/base/progress.h"

namespace dtr {

/// ParallelFor over [0, count) that counts its items in the stage that runs, and throws Interrupted
/// between items where the user asked to stop.
void CountedFor(int count, int threads, Progress& progress, const std::function<void(int)>& body);

}  // namespace dtr
