// tests/cli/failing_calls.h -- runs `dtr` where calls of the system fail (failing_calls.cpp).
#pragma once
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/cli/run_dtr.h"

namespace dtr::testing {

/// `variable`: DTR_TEST_THREADS or DTR_TEST_KILLED_AT.
inline Ran DtrWithFailingCalls(const std::string& variable, int number,
                               const std::vector<std::string>& words) {
  setenv("LD_PRELOAD", DTR_FAILING_CALLS, 1);
  setenv(variable.c_str(), std::to_string(number).c_str(), 1);
  const Ran ran = DtrByItself(words);
  unsetenv(variable.c_str());
  unsetenv("LD_PRELOAD");
  return ran;
}

}  // namespace dtr::testing

/// Sanitizers want to be the first library themselves.
#ifdef DTR_SANITIZED
#define DTR_REQUIRE_FAILING_CALLS() \
  GTEST_SKIP() << "SKIPPED: a sanitizer takes no library before its own"
#else
#define DTR_REQUIRE_FAILING_CALLS() static_assert(true)
#endif
