#include "dtr/base/parallel_for.h"

#include <algorithm>

#include "dtr/base/machine.h"
#include "dtr/base/thread_pool.h"
#include "dtr/base/trace.h"

namespace dtr {
namespace {

thread_local int thread_limit = 0;

}  // namespace

ThreadLimit::ThreadLimit(int threads) : before_(thread_limit) { thread_limit = threads; }

ThreadLimit::~ThreadLimit() { thread_limit = before_; }

int ThreadLimit::Current() { return thread_limit > 0 ? thread_limit : Cores(); }

void ParallelFor(int begin, int end, const std::function<void(int)>& body) {
  ParallelFor(begin, end, end - begin, body);
}

void ParallelFor(int begin, int end, int at_once, const std::function<void(int)>& body) {
  if (begin >= end) return;
  const int request = ThreadLimit::Current();
  const int limit = std::min({request, end - begin, at_once});
  if (limit <= 1) {
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
