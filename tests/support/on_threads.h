// tests/support/on_threads.h -- work on a given number of threads.
#pragma once
#include "dtr/base/parallel_for.h"

namespace dtr {

/// What `work()` gives on so many threads.
template <typename Work>
auto OnThreads(int threads, const Work& work) {
  const ThreadLimit limit(threads);
  return work();
}

}  // namespace dtr
