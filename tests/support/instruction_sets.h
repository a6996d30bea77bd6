// tests/support/instruction_sets.h -- runs kernels with every instruction set of the machine, not
// with its best alone.
#pragma once
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstdint>
#include <functional>

namespace dtr::testing {

/// Calls `check` once for each instruction set that this machine has and kernels were compiled
/// for (one bit of Highway's HWY_AVX2, ...), with that one chosen; the best is chosen again
/// afterwards. Assertions that end a function end only the call they stand in.
inline void WithEachInstructionSet(const std::function<void(std::int64_t target)>& check) {
  const auto choose = [](std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().DeInit();
  };
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
    const std::int64_t target = left & -left;
    SCOPED_TRACE(hwy::TargetName(target));
    choose(target);
    check(target);
  }
  choose(0);
}

}  // namespace dtr::testing
