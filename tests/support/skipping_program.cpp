// Not a test: what test_main_test runs.
#include <gtest/gtest.h>

TEST(Program, Passes) {}
TEST(Program, Skips) { GTEST_SKIP() << "as told"; }
TEST(Program, Fails) { FAIL() << "as told"; }
