// dtr/base/machine.h -- what a measurement ran on, and how much of it it used.
#pragma once
#include <cstddef>
#include <string>

namespace dtr {

/// The processor as it calls itself, "unknown" where the system does not say.
std::string CpuModel();

/// The processors that the system shows, at least 1.
int Cores();

/// Processor time of this process so far, all threads, in milliseconds. Unlike a clock on the wall
/// it does not count what other programs used.
double ProcessCpuMilliseconds();

/// The most physical memory this process had so far.
size_t PeakMemoryBytes();
/// The same of this process or of any program that it ran to its end, whichever had most.
size_t PeakMemoryBytesWithPrograms();
/// What this process has just now; 0 where the system does not say.
size_t MemoryBytes();

/// Returns to the system the memory that was freed but that the allocator still holds; nothing
/// without glibc.
void ReturnFreedMemory();

/// Memory that this process may have: the machine's, or less where a limit is set (ulimit -v).
double MachineMemoryBytes();

}  // namespace dtr
