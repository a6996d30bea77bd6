#include "dtr/base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace dtr {

int ResolveThreads(int requested) {
  if (requested > 0) return requested;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void ParallelFor(int begin, int end, int threads, const std::function<void(int)>& body) {
  if (begin >= end) return;
  const int workers = std::min(ResolveThreads(threads), end - begin);
  if (workers == 1) {
    for (int i = begin; i < end; ++i) body(i);
    return;
  }

  std::atomic<int> next{begin};
  std::atomic<bool> failed{false};
  std::mutex mutex;
  std::exception_ptr first_error;
  int first_error_item = end;

  const auto work = [&] {
    while (!failed.load(std::memory_order_relaxed)) {
      const int i = next.fetch_add(1, std::memory_order_relaxed);
      if (i >= end) return;
      try {
        body(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (i < first_error_item) {
          first_error_item = i;
          first_error = std::current_exception();
        }
        failed.store(true, std::memory_order_relaxed);
      }
    }
  };
  {
    std::vector<std::jthread> pool;
    pool.reserve(static_cast<size_t>(workers) - 1);
    for (int t = 1; t < workers; ++t) pool.emplace_back(work);
    work();
  }  // joins
  if (first_error) std::rethrow_exception(first_error);
}

}  // namespace dtr
