#include "dtr/base/parallel_for.h"

#include <algorithm>
#include <thread>

#include "dtr/base/thread_pool.h"

namespace dtr {

int ResolveThreads(int requested) {
  if (requested > 0) return requested;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void ParallelFor(int begin, int end, int threads, const std::function<void(int)>& body) {
  if (begin >= end) return;
  const int request = ResolveThreads(threads);
  const int limit = std::min(request, end - begin);
  if (limit == 1) {
    for (int i = begin; i < end; ++i) body(i);
    return;
  }
  Loop loop(begin, end, limit, request, body, ThreadPool::Current());
  ThreadPool::OfProcess().Run(loop);
}

}  // namespace dtr
