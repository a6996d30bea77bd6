// main() of test programs.
#include <gtest/gtest.h>

#include "tests/support/test_main.h"

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  const int result = RUN_ALL_TESTS();
  // A failure is a failure, whatever was skipped beside it.
  if (result != 0) return result;
  const auto& tests = *::testing::UnitTest::GetInstance();
  return tests.skipped_test_count() > 0 ? dtr::testing::kSkippedExitCode : 0;
}
