#include "dtr/base/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <tuple>

#include "dtr/base/error.h"

namespace dtr {
namespace {

constexpr int kPollMs = 100;                      // how soon a request to stop is noticed
constexpr auto kGrace = std::chrono::seconds(5);  // between SIGTERM and SIGKILL
constexpr size_t kLongestLine = 1 << 16;          // a program without line ends must not eat memory

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

// Splits a stream into lines; '\r' ends a line too (progress bars).
class LineSplitter {
 public:
  explicit LineSplitter(const std::function<void(const std::string&)>& sink) : sink_(sink) {}
  void Feed(const char* data, size_t size) {
    for (size_t i = 0; i < size; ++i) {
      if (data[i] == '\n' || data[i] == '\r' || line_.size() >= kLongestLine) Flush();
      if (data[i] != '\n' && data[i] != '\r') line_.push_back(data[i]);
    }
  }
  void Flush() {
    if (!line_.empty() && sink_) sink_(line_);
    line_.clear();
  }

 private:
  const std::function<void(const std::string&)>& sink_;
  std::string line_;
};

// Only async-signal-safe calls between fork and exec.
[[noreturn]] void ExecChild(pid_t parent, const std::vector<char*>& argv, const char* directory,
                            int output) {
  // We may be killed without a word; a program left running would go on writing into the folder
  // that the next run continues in. (Of the thread that forked: it waits here until the end.)
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // killed before that call
  setpgid(0, 0);                        // Ctrl-C reaches us alone; we stop the child in order
  const int null_input = open("/dev/null", O_RDONLY);
  dup2(null_input, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  if (directory != nullptr && chdir(directory) != 0) _exit(126);
  execv(argv[0], argv.data());
  _exit(127);
}

// Reads the child's output until it closes it, stopping the child on request.
void Drain(pid_t child, int output, const ProcessOptions& options) {
  const int log = options.log_file.empty()
                      ? -1
                      : open(options.log_file.c_str(),
                             O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0644);
  LineSplitter lines(options.on_line);
  char buffer[4096];
  bool asked_to_stop = false;
  std::chrono::steady_clock::time_point kill_at;
  for (;;) {
    if (!asked_to_stop && options.should_stop && options.should_stop()) {
      asked_to_stop = true;
      kill_at = std::chrono::steady_clock::now() + kGrace;
      kill(-child, SIGTERM);
    }
    if (asked_to_stop && std::chrono::steady_clock::now() > kill_at) kill(-child, SIGKILL);
    pollfd waiting{output, POLLIN, 0};
    const int ready = poll(&waiting, 1, kPollMs);
    if (ready < 0 && errno != EINTR) break;
    if (ready <= 0) continue;
    const ssize_t got = read(output, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    if (log >= 0) std::ignore = write(log, buffer, static_cast<size_t>(got));
    lines.Feed(buffer, static_cast<size_t>(got));
  }
  lines.Flush();
  if (log >= 0) close(log);
}

}  // namespace

std::filesystem::path FindProgram(const std::string& program) {
  if (program.find('/') != std::string::npos) {
    return access(program.c_str(), X_OK) == 0 ? std::filesystem::path(program)
                                              : std::filesystem::path();
  }
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const auto candidate = std::filesystem::path(folder.empty() ? "." : folder) / program;
    std::error_code ignored;
    if (access(candidate.c_str(), X_OK) == 0 &&
        std::filesystem::is_regular_file(candidate, ignored)) {
      return candidate;
    }
  }
  return {};
}

ProcessResult RunProcess(const std::vector<std::string>& argv, const ProcessOptions& options) {
  const auto program = argv.empty() ? std::filesystem::path() : FindProgram(argv.front());
  if (program.empty()) {
    throw Error((argv.empty() ? std::string("(no program)") : argv.front()) +
                ": program not found on the PATH; install it");
  }
  std::vector<std::string> arguments = argv;
  arguments.front() = program.string();
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  const std::string directory = options.working_directory.string();

  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    throw Error(argv.front() + ": no pipe: " + std::strerror(errno));
  }
  const auto start = std::chrono::steady_clock::now();
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    close(ends[0]);
    close(ends[1]);
    throw Error(argv.front() + ": cannot start: " + std::strerror(errno));
  }
  if (child == 0) {
    ExecChild(parent, pointers, directory.empty() ? nullptr : directory.c_str(), ends[1]);
  }
  setpgid(child, child);  // as the child does: whoever is first, stopping it then reaches it
  close(ends[1]);
  Drain(child, ends[0], options);
  close(ends[0]);

  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  ProcessResult result;
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  result.max_rss_kib = usage.ru_maxrss;
  return result;
}

std::vector<std::string> CommandLine() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  return words;
}

}  // namespace dtr
