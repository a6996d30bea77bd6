// Itself compiled without counting.
#include "tests/support/count_steps.h"

namespace {
thread_local std::uint64_t steps_made = 0;
}

extern "C" void __sanitizer_cov_trace_pc() { ++steps_made; }

namespace dtr::testing {
std::uint64_t StepsMade() { return steps_made; }
}  // namespace dtr::testing
