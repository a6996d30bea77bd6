// tests/bench/load_bench.cpp -- what does it cost to read every pixel of a set by io::LoadSet? The
// other half of tests/python/load_bench.py, which reads the same by `import dtr`.
//
//   load_bench SET.dtr
//
// Prints the processor seconds of one thread, from the set's description to the last pixel, and the
// bytes of the pixels.
#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <exception>

#include "dtr/io/set_io.h"

namespace {

double CpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: load_bench SET.dtr\n", stderr);
    return 2;
  }
  try {
    dtr::io::LoadOptions options;
    options.images = options.depth = options.completed = options.sigma = options.held_out = true;
    options.collapse_duplicates = false;  // every view, as Python has them
    const double start = CpuSeconds();
    const dtr::DtrSet set = dtr::io::LoadSet(argv[1], options);
    const double seconds = CpuSeconds() - start;
    fmt::print("{:.6f}\n", seconds);
    return set.frames.empty() ? 1 : 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
