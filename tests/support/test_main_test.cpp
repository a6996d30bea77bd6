#include "tests/support/test_main.h"

#include <gtest/gtest.h>

#include <string>

#include "dtr/base/process.h"

namespace dtr::testing {
namespace {

int ExitCodeOf(const std::string& tests) {
  return RunProcess({DTR_SKIPPING_PROGRAM, "--gtest_filter=" + tests}, {}).exit_code;
}

TEST(TestMain, AFailureIsNeverHiddenByWhatWasSkipped) {
  EXPECT_EQ(ExitCodeOf("*.Passes"), 0);
  EXPECT_EQ(ExitCodeOf("*.Skips"), kSkippedExitCode);
  EXPECT_EQ(ExitCodeOf("*.Skips:*.Passes"), kSkippedExitCode);
  EXPECT_EQ(ExitCodeOf("*.Fails:*.Passes"), 1);
  EXPECT_EQ(ExitCodeOf("*.Fails:*.Skips"), 1);
}

}  // namespace
}  // namespace dtr::testing
