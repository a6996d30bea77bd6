// tests/support/count_steps.h -- how much work something is, in steps and not in seconds.
#pragma once
#include <cstdint>

namespace dtr::testing {

/// Steps that this thread made so far in code compiled with -fsanitize-coverage=trace-pc: a step is
/// a piece of code without branches. The same for every run of the same program.
std::uint64_t StepsMade();

template <typename Work>
std::uint64_t StepsOf(const Work& work) {
  const std::uint64_t before = StepsMade();
  work();
  return StepsMade() - before;
}

}  // namespace dtr::testing
