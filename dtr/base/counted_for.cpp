#include "dtr/base/counted_for.h"

#include <mutex>

#include "dtr/base/parallel_for.h"

namespace dtr {

void CountedFor(int count, Progress& progress, const std::function<void(int)>& body) {
  CountedFor(count, count, progress, body);
}

void CountedFor(int count, int at_once, Progress& progress, const std::function<void(int)>& body) {
  std::mutex mutex;
  int done = 0;
  ParallelFor(0, count, at_once, [&](int i) {
    progress.ThrowIfInterrupted();
    body(i);
    const std::lock_guard lock(mutex);  // the count reported only grows
    progress.Update(++done);
  });
}

}  // namespace dtr
