// dtr/base/counted_for.h -- a parallel loop that its user can see and stop.
#pragma once
#include <functional>

#include "dtr/base/progress.h"

namespace dtr {

/// ParallelFor over [0, count) that counts its items in the stage that runs, and throws Interrupted
/// between items where the user asked to stop.
void CountedFor(int count, Progress& progress, const std::function<void(int)>& body);
/// At most `at_once` items at a time.
void CountedFor(int count, int at_once, Progress& progress, const std::function<void(int)>& body);

}  // namespace dtr
