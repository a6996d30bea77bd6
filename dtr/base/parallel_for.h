// dtr/base/parallel_for.h -- the one parallel loop of the toolkit.
#pragma once
#include <functional>

namespace dtr {

/// Threads to use for a request: itself when positive, else the hardware's number (at least 1).
int ResolveThreads(int requested);

/// Calls `body(i)` once for every i in [begin, end), in rising order, on up to `threads` threads
/// (0: all cores), as many as the system gives; loops inside a body share them (thread_pool.h).
/// Results must not depend on which thread runs an item, nor a body wait for another item. The
/// exception of the smallest i among those that threw is rethrown when all threads have left; items
/// not yet started are left out.
void ParallelFor(int begin, int end, int threads, const std::function<void(int)>& body);

}  // namespace dtr
