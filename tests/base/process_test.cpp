#include "dtr/base/process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <thread>

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

bool Within(std::chrono::seconds limit, const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

// Ended, though perhaps not yet waited for by whoever inherited it.
bool IsGone(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  if (!status) return true;
  const std::string text((std::istreambuf_iterator<char>(status)), {});
  return text.find("State:\tZ") != std::string::npos;
}

TEST(RunProcess, TheProgramEndsWithUsWhenWeAreKilled) {
  const testing::TemporaryFolder folder;
  const std::filesystem::path ready = folder / "ready", pid_file = folder / "pid";
  const std::string script = "echo $$ > '" + pid_file.string() + "'; touch '" + ready.string() +
                             "'; exec sleep 600 > /dev/null 2>&1";
  const pid_t runner = fork();
  if (runner == 0) {
    RunProcess({"sh", "-c", script}, {});
    _exit(0);
  }
  ASSERT_TRUE(Within(std::chrono::seconds(60), [&] { return std::filesystem::exists(ready); }));
  const pid_t program = std::stoi(ReadFile(pid_file, kLogLimit));
  EXPECT_FALSE(IsGone(program));
  kill(runner, SIGKILL);
  waitpid(runner, nullptr, 0);
  EXPECT_TRUE(Within(std::chrono::seconds(60), [&] { return IsGone(program); }));
  kill(program, SIGKILL);
}

TEST(RunProcess, ASignalIsNotAnExitCode) {
  const auto result = RunProcess({"sh", "-c", "kill -9 $$"}, {});
  EXPECT_EQ(result.signal, SIGKILL);
  EXPECT_FALSE(result.Ok());
}

}  // namespace
}  // namespace dtr
