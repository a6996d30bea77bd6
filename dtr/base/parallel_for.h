// dtr/base/parallel_for.h -- the one parallel loop of the toolkit.
#pragma once
#include <functional>

namespace dtr {

/// Threads to use for a request: itself when positive, else the hardware's number (at least 1).
int ResolveThreads(int requested);

/// Calls `body(i)` once for every i in [begin, end), on up to `threads` threads (0: all cores), as
/// many as the system gives. Items are handed out one by one in rising order: results must not
/// depend on which thread runs an item; then they do not depend on the number of threads either.
/// The first exception (that of the smallest i among those thrown) is rethrown after all threads
/// have stopped; items not yet started are then left out.
void ParallelFor(int begin, int end, int threads, const std::function<void(int)>& body);

}  // namespace dtr
