// tests/viewer/viewer_program.h -- `dtr view` on a display of its own, worked with xdotool.
#pragma once
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "dtr/base/process.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

/// A viewer that runs until it is told to stop. Its state file says what the window shows.
class ViewerProgram {
 public:
  using Json = nlohmann::json;

  /// What it tells goes into `folder`; what it saves, too, or into `output`.
  ViewerProgram(const std::string& set, const std::filesystem::path& folder,
                const std::vector<std::string>& further = {},
                const std::filesystem::path& output = {})
      : state_file_(folder / "state.json") {
    const std::string saves_into = (output.empty() ? folder : output).string();
    std::vector<std::string> args{
        DTR_PROGRAM, "view", set, "-o", saves_into, "--state-file", state_file_.string()};
    args.insert(args.end(), further.begin(), further.end());
    child_ = fork();
    if (child_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      std::vector<char*> argv;
      for (std::string& arg : args) argv.push_back(arg.data());
      argv.push_back(nullptr);
      execv(DTR_PROGRAM, argv.data());
      _exit(127);
    }
  }
  ~ViewerProgram() {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }
  ViewerProgram(const ViewerProgram&) = delete;
  ViewerProgram& operator=(const ViewerProgram&) = delete;

  /// Runs `xdotool WORDS...` and expects that it works.
  static void Do(const std::vector<std::string>& words) {
    std::vector<std::string> argv{"xdotool"};
    argv.insert(argv.end(), words.begin(), words.end());
    EXPECT_TRUE(RunProcess(argv, {}).Ok()) << words.front();
  }

  /// The state once it is of a whole image and `holds`; a failure after a while.
  Json WaitFor(const std::string& what, const std::function<bool(const Json&)>& holds) {
    const auto start = std::chrono::steady_clock::now();
    Json state;
    while (std::chrono::steady_clock::now() - start < kPatience) {
      if (std::filesystem::exists(state_file_)) {
        state = Json::parse(Text(state_file_));
        if (state["still"].get<bool>() && holds(state)) return state;
      }
      if (waitpid(child_, nullptr, WNOHANG) != 0) {
        child_ = -1;
        ADD_FAILURE() << "the viewer ended before: " << what;
        return state;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ADD_FAILURE() << "never: " << what << "\n" << state.dump(1);
    return state;
  }

  struct End {
    int code = -1;     // -1 where a signal ended it
    double cpu_s = 0;  // of all threads: from the signal on, or in all
  };
  End EndBy(int signal) {
    const double before_s = CpuSeconds();
    kill(child_, signal);
    End end = Wait();
    end.cpu_s -= before_s;
    return end;
  }
  int WaitForEnd() { return Wait().code; }

 private:
  End Wait() {
    const auto start = std::chrono::steady_clock::now();
    int status = 0;
    rusage used{};
    while (wait4(child_, &status, WNOHANG, &used) == 0) {
      if (std::chrono::steady_clock::now() - start > kPatience) {
        ADD_FAILURE() << "the viewer never ended";
        return {};
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    child_ = -1;
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1,
            seconds(used.ru_utime) + seconds(used.ru_stime)};
  }
  // CPU time of all its threads until now, s.
  double CpuSeconds() const {
    clockid_t clock{};
    timespec time{};
    if (clock_getcpuclockid(child_, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  static constexpr std::chrono::seconds kPatience{120};  // of a loaded machine with sanitizers
  std::filesystem::path state_file_;
  pid_t child_ = -1;
};

}  // namespace dtr::testing
