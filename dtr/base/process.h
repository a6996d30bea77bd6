// dtr/base/process.h -- runs other programs, never through a shell.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace dtr {

/// How an external program ended and what it cost.
struct ProcessResult {
  int exit_code = 0;     ///< meaningful when signal == 0
  int signal = 0;        ///< the signal that ended it, or 0
  double wall_s = 0;     ///< wall-clock seconds
  double cpu_s = 0;      ///< user + system seconds
  long max_rss_kib = 0;  ///< peak resident memory
  bool Ok() const { return signal == 0 && exit_code == 0; }
};

/// What to do with a program while it runs.
struct ProcessOptions {
  std::filesystem::path log_file;                   ///< receives stdout and stderr; empty: none
  std::function<void(const std::string&)> on_line;  ///< called for every line of output
  std::function<bool()> should_stop;                ///< true: the program is terminated
  std::filesystem::path working_directory;          ///< empty: unchanged
};

/// Full path of `program` on the PATH, or empty when it is not there.
std::filesystem::path FindProgram(const std::string& program);

/// Runs argv[0] with its arguments and waits for it. The program ends with us, however we end: a
/// kill -9 leaves no orphan that writes on. Throws Error when it cannot be started.
ProcessResult RunProcess(const std::vector<std::string>& argv, const ProcessOptions& options);

/// Name and arguments that this program was started with, byte for byte; empty where the system
/// does not say.
std::vector<std::string> CommandLine();

}  // namespace dtr
