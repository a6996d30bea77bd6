// dtr/base/parallel_for.h -- the one parallel loop of the toolkit, and how many threads it may use.
#pragma once
#include <functional>

namespace dtr {

/// How many threads the parallel loops of the calling thread may use, with the loops inside them,
/// until it goes; the one before it holds again then. Belongs to the thread and not to arguments:
/// no function between a command and its innermost loop has to hand it on, and none can forget to.
/// No result depends on it.
class ThreadLimit {
 public:
  /// 0: all cores, as where there is none.
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

  /// Of the calling thread: at least 1. For what is divided by it: memory, processes, strips.
  static int Current();

 private:
  const int before_;
};

/// Calls `body(i)` once for every i in [begin, end), in rising order, on up to as many threads as
/// the caller's ThreadLimit has, as many as the system gives; loops inside a body share them
/// (thread_pool.h). Results must not depend on which thread runs an item, nor a body wait for
/// another item. The exception of the smallest i among those that threw is rethrown when all
/// threads have left; items not yet started are left out.
void ParallelFor(int begin, int end, const std::function<void(int)>& body);

/// The same with at most `at_once` items at a time, where there is no memory for more; loops inside
/// a body use all threads.
void ParallelFor(int begin, int end, int at_once, const std::function<void(int)>& body);

}  // namespace dtr
