#include "dtr/base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace dtr {
namespace {

// At most so many threads: the first one that the system rejects is the last one that is asked for.
std::vector<std::jthread> StartThreads(int count, const std::function<void()>& work) {
  std::vector<std::jthread> threads;
  threads.reserve(static_cast<size_t>(count));
  try {
    for (int t = 0; t < count; ++t) threads.emplace_back(work);
  } catch (const std::system_error&) {
  }
  return threads;
}

}  // namespace

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
    const std::vector<std::jthread> pool = StartThreads(workers - 1, work);
    work();
  }  // joins
  if (first_error) std::rethrow_exception(first_error);
}

}  // namespace dtr
