#include "tests/cli/run_dtr.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <sstream>
#include <thread>

#include "dtr/base/files.h"
#include "tests/cli/program_server.h"
#include "tests/support/test_data.h"
#include "tests/support/test_main.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLimitBytes = 1 << 26;

[[noreturn]] void Exec(const std::vector<std::string>& args, const fs::path& out,
                       const fs::path& err) {
  std::vector<char*> argv = {const_cast<char*>(DTR_PROGRAM)};
  for (const std::string& arg : args) argv.push_back(const_cast<char*>(arg.c_str()));
  argv.push_back(nullptr);
  for (const auto& [file, target] : {std::pair(&out, 1), std::pair(&err, 2)}) {
    dup2(open(file->c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), target);
  }
  execv(DTR_PROGRAM, argv.data());
  _exit(127);
}

// The status as waitpid gives it.
int RunByItself(const std::vector<std::string>& args, const TemporaryFolder& folder,
                const Interruption& interruption) {
  const pid_t child = fork();
  if (child == 0) Exec(args, folder / "out", folder / "err");
  int status = 0;
  bool sent = interruption.signal == 0;
  while (!sent && waitpid(child, &status, WNOHANG) == 0) {
    if (interruption.when()) {
      kill(child, interruption.signal);
      sent = true;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  if (sent) waitpid(child, &status, 0);
  return status;
}

Ran RanWith(int status, const TemporaryFolder& folder) {
  Ran ran;
  if (WIFSIGNALED(status)) ran.signal = WTERMSIG(status);
  if (WIFEXITED(status)) ran.code = WEXITSTATUS(status);
  ran.out = Text(folder / "out");
  ran.err = Text(folder / "err");
  // Tests of what this program was built without are skipped, with all of their suite that follow.
  if (ran.err.find("this program was built without '") != std::string::npos &&
      !::testing::UnitTest::GetInstance()->Failed()) {
    std::cout << "SKIPPED: " << ran.err << std::flush;
    std::exit(kSkippedExitCode);
  }
  return ran;
}

}  // namespace

std::vector<std::string> Ran::ErrorLines() const {
  std::vector<std::string> lines;
  std::istringstream in(err);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("dtr: ")) lines.push_back(line);
  }
  return lines;
}

Ran Dtr(const std::vector<std::string>& args, const Interruption& interruption) {
  if (interruption.signal != 0) return DtrByItself(args, interruption);
  const TemporaryFolder folder;
  const auto status = RunByServer(args, folder / "out", folder / "err");
  return status ? RanWith(*status, folder) : DtrByItself(args);
}

Ran DtrByItself(const std::vector<std::string>& args, const Interruption& interruption) {
  const TemporaryFolder folder;
  return RanWith(RunByItself(args, folder, interruption), folder);
}

Ran DtrOk(const std::vector<std::string>& args) {
  Ran ran = Dtr(args);
  EXPECT_EQ(ran.signal, 0);
  EXPECT_EQ(ran.code, 0) << ran.err;
  return ran;
}

bool IsDone(const Ran& ran) {
  const std::string all = ran.out + ran.err;
  return ran.code == 0 ||
         (ran.code == kFailed && all.find("validation FAILED: ") != std::string::npos);
}

Ran DtrCalibrated(const std::vector<std::string>& args) {
  Ran ran = Dtr(args);
  EXPECT_EQ(ran.signal, 0) << ran.err;
  EXPECT_TRUE(IsDone(ran)) << ran.err;
  return ran;
}

void ExpectRejected(const Ran& ran, int code, const std::string& text) {
  EXPECT_EQ(ran.signal, 0) << ran.err;
  EXPECT_EQ(ran.code, code) << ran.err;
  const std::vector<std::string> lines = ran.ErrorLines();
  ASSERT_EQ(lines.size(), 1u) << ran.err;
  EXPECT_THAT(lines[0], ::testing::HasSubstr(text));
  EXPECT_TRUE(ran.err.ends_with(lines[0] + "\n")) << "something follows the error:\n" << ran.err;
}

std::map<std::string, std::string> Contents(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().string().ends_with("/report/run.json")) continue;
    contents[entry.path().lexically_relative(folder).string()] = Text(entry.path());
  }
  return contents;
}

std::vector<std::string> DifferingFiles(const std::map<std::string, std::string>& a,
                                        const std::map<std::string, std::string>& b) {
  std::vector<std::string> names;
  for (const auto& [name, bytes] : a) {
    const auto other = b.find(name);
    if (other == b.end() || other->second != bytes) names.push_back(name);
  }
  for (const auto& [name, bytes] : b) {
    if (!a.contains(name)) names.push_back(name);
  }
  return names;
}

int FilesIn(const fs::path& folder) {
  std::error_code ignored;
  int files = 0;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    files += entry.is_regular_file(ignored) ? 1 : 0;
  }
  return files;
}

std::string Text(const fs::path& file) { return ReadFile(file, kLimitBytes); }

void ImportSmallCourtyard(const std::filesystem::path& courtyard,
                          const std::filesystem::path& set) {
  DtrOk({"import", "--cameras", (courtyard / "cameras.json").string(), "--images",
         (courtyard / "images").string(), "--depth", (courtyard / "depth").string(), "--holdout",
         "every:4", "-o", set.string()});
}

}  // namespace dtr::testing
