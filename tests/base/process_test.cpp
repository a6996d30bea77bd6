#include "dtr/base/process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/test_data.h"

namespace dtr {
namespace {

constexpr size_t kLogLimit = 1 << 20;

TEST(RunProcess, ReportsExitCodeLinesAndLog) {
  const testing::TemporaryFolder folder;
  std::vector<std::string> lines;
  ProcessOptions options;
  options.log_file = folder / "log.txt";
  options.on_line = [&](const std::string& line) { lines.push_back(line); };
  const auto result = RunProcess({"sh", "-c", "echo one; echo two >&2; exit 3"}, options);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.signal, 0);
  EXPECT_FALSE(result.Ok());
  EXPECT_THAT(lines, ::testing::ElementsAre("one", "two"));
  EXPECT_EQ(ReadFile(options.log_file, kLogLimit), "one\ntwo\n");
}

TEST(RunProcess, ArgumentsReachTheProgramUntouchedByAnyShell) {
  std::vector<std::string> lines;
  ProcessOptions options;
  options.on_line = [&](const std::string& line) { lines.push_back(line); };
  EXPECT_TRUE(RunProcess({"printf", "%s\\n", "a b; $(echo c) 'd'"}, options).Ok());
  EXPECT_THAT(lines, ::testing::ElementsAre("a b; $(echo c) 'd'"));
}

TEST(RunProcess, MissingProgramIsAnErrorThatNamesIt) {
  try {
    RunProcess({"no-such-program-anywhere"}, {});
    FAIL() << "started a program that does not exist";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("no-such-program-anywhere"));
  }
}

TEST(RunProcess, StopsTheProgramOnRequest) {
  ProcessOptions options;
  options.should_stop = [] { return true; };
  const auto result = RunProcess({"sleep", "60"}, options);
  EXPECT_EQ(result.signal, SIGTERM);
  EXPECT_LT(result.wall_s, 30.0);
}

TEST(RunProcess, ASignalIsNotAnExitCode) {
  const auto result = RunProcess({"sh", "-c", "kill -9 $$"}, {});
  EXPECT_EQ(result.signal, SIGKILL);
  EXPECT_FALSE(result.Ok());
}

}  // namespace
}  // namespace dtr
