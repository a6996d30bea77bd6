#include "dtr/base/parallel_for.h"

#include <algorithm>
#include <thread>

#include "dtr/base/thread_pool.h"
#include "dtr/base/trace.h"

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
  const auto run = [&](const std::function<void(int)>& of_item) {
    Loop loop(begin, end, limit, request, of_item, ThreadPool::Current());
    ThreadPool::OfProcess().Run(loop);
  };
  trace::IsOn() ? trace::Loop(limit, body, run) : run(body);
}

}  // namespace dtr
