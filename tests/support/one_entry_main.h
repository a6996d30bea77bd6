// tests/support/one_entry_main.h -- how a test program of one CTest entry ends.
#pragma once

namespace dtr::testing {

/// Nothing failed, something was skipped: CTest says "Skipped" (dtr_one_entry_test).
inline constexpr int kSkippedExitCode = 77;

}  // namespace dtr::testing
