// tests/support/virtual_display.h -- a display of a test's own, so that no window opens on the
// user's.
#pragma once
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <memory>
#include <string>

#include "tests/support/environment.h"

namespace dtr::testing {

/// An X server without a screen (Xvfb), and DISPLAY set to it, for the length of a scope.
///
/// The server chooses a free number itself and writes it once it takes connections. `xvfb-run`
/// waits for a signal instead, which is lost when it comes before the wait or is ignored by the
/// caller: then it waits for ever. Nor does it start again when its last window closes, for whoever
/// opens the next one meanwhile is turned away.
class VirtualDisplay {
 public:
  /// `screen` as Xvfb takes it: width x height x bits.
  explicit VirtualDisplay(const std::string& screen = "1280x800x24") {
    int pipe_fds[2];
    if (pipe(pipe_fds) != 0) return;
    server_ = fork();
    if (server_ == 0) Serve(pipe_fds[1], screen);
    close(pipe_fds[1]);
    const std::string number = ReadLine(pipe_fds[0]);
    close(pipe_fds[0]);
    if (!number.empty()) display_ = std::make_unique<Environment>("DISPLAY", ":" + number);
  }
  ~VirtualDisplay() {
    display_.reset();
    if (server_ <= 0) return;
    kill(server_, SIGTERM);
    waitpid(server_, nullptr, 0);
  }
  VirtualDisplay(const VirtualDisplay&) = delete;
  VirtualDisplay& operator=(const VirtualDisplay&) = delete;

  /// False when Xvfb is missing or did not come up.
  [[nodiscard]] bool up() const { return display_ != nullptr; }

 private:
  static constexpr int kPatienceMs = 60'000;

  // The child: becomes the server, and ends with the test program, however that ends.
  [[noreturn]] static void Serve(int number_fd, const std::string& screen) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int silence = open("/dev/null", O_RDWR);
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(silence, fd);
    const std::string number = std::to_string(number_fd);
    execlp("Xvfb", "Xvfb", "-noreset", "-displayfd", number.c_str(), "-screen", "0", screen.c_str(),
           "-nolisten", "tcp", static_cast<char*>(nullptr));
    _exit(127);
  }

  // Up to the newline; empty when the writer goes, or says nothing for too long.
  static std::string ReadLine(int fd) {
    std::string line;
    char character = 0;
    pollfd ready{fd, POLLIN, 0};
    while (poll(&ready, 1, kPatienceMs) > 0 && read(fd, &character, 1) == 1) {
      if (character == '\n') return line;
      line += character;
    }
    return {};
  }

  pid_t server_ = -1;
  std::unique_ptr<Environment> display_;
};

}  // namespace dtr::testing
