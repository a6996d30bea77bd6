// tests/support/test_main.h -- how a test program ends.
#pragma once

namespace dtr::testing {

/// Nothing failed, something was skipped: CTest says "Skipped".
inline constexpr int kSkippedExitCode = 77;

}  // namespace dtr::testing
