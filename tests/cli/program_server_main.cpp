// The server of program_server.h: `dtr`, loaded, that forks for every run it is asked for.
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "cli/program.h"
#include "tests/cli/program_server.h"

namespace {

[[noreturn]] void Become(const dtr::testing::ProgramRun& run) {
  close(dtr::testing::kServerSocket);
  if (chdir(run.folder.c_str()) != 0) _exit(127);
  umask(run.umask);
  clearenv();
  for (const std::string& variable : run.environment) putenv(strdup(variable.c_str()));
  for (const auto& [file, target] : {std::pair(&run.out, 1), std::pair(&run.err, 2)}) {
    const int opened = open(file->c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    dup2(opened, target);
    close(opened);
  }
  std::vector<char*> argv = {strdup(DTR_PROGRAM)};
  for (const std::string& arg : run.args) argv.push_back(strdup(arg.c_str()));
  argv.push_back(nullptr);
  const int code = dtr::cli::RunProgram(static_cast<int>(argv.size()) - 1, argv.data());
  // No exit(): log4cplus, which comes with the image library, started threads as it was loaded, has
  // none of them here, and would wait for them.
  std::fflush(nullptr);
  _exit(code);
}

}  // namespace

int main() {
  while (const auto run = dtr::testing::ReceiveRun(dtr::testing::kServerSocket)) {
    const pid_t child = fork();
    if (child == 0) Become(*run);
    int status = 127 << 8;  // of a fork that failed
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    const std::int32_t sent = status;
    if (!dtr::testing::WriteAll(dtr::testing::kServerSocket, &sent, sizeof(sent))) break;
  }
  return 0;
}
