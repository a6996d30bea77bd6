#include "dtr/base/machine.h"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <fstream>
#include <thread>

namespace dtr {

std::string CpuModel() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown";
}

int Cores() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

double ProcessCpuMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

namespace {

size_t PeakMemoryBytesOf(int who) {
  rusage usage{};
  getrusage(who, &usage);
  return static_cast<size_t>(usage.ru_maxrss) << 10;
}

}  // namespace

size_t PeakMemoryBytes() { return PeakMemoryBytesOf(RUSAGE_SELF); }

size_t PeakMemoryBytesWithPrograms() {
  return std::max(PeakMemoryBytes(), PeakMemoryBytesOf(RUSAGE_CHILDREN));
}

void ReturnFreedMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

double MachineMemoryBytes() {
  const double machine =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return machine;
  return std::min(machine, static_cast<double>(limit.rlim_cur));
}

size_t MemoryBytes() {
  std::ifstream in("/proc/self/statm");  // pages: virtual, physical, ...
  size_t all = 0, physical = 0;
  if (!(in >> all >> physical)) return 0;
  return physical * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace dtr
