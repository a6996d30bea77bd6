#include "tests/cli/program_server.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <mutex>

extern char** environ;

namespace dtr::testing {
namespace {

// What a process hands down, and a server that runs already would not.
struct Inherited {
  uid_t user = geteuid();
  std::filesystem::path mounts = std::filesystem::read_symlink("/proc/self/ns/mnt");
  std::array<rlimit, RLIM_NLIMITS> limits{};

  Inherited() {
    for (int i = 0; i < RLIM_NLIMITS; ++i) {
      getrlimit(static_cast<__rlimit_resource>(i), &limits[static_cast<size_t>(i)]);
    }
  }
  bool operator==(const Inherited& other) const {
    return user == other.user && mounts == other.mounts &&
           std::memcmp(limits.data(), other.limits.data(), sizeof(limits)) == 0;
  }
};

constexpr int kNoServer = 126 << 8;  // as waitpid gives exit code 126

class Server {
 public:
  Server() {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return;
    const pid_t child = fork();
    if (child == 0) {
      // dup2 onto itself would leave the descriptor to be closed.
      if (ends[1] == kServerSocket) {
        fcntl(ends[1], F_SETFD, 0);
      } else {
        dup2(ends[1], kServerSocket);
      }
      execl(DTR_PROGRAM_SERVER, DTR_PROGRAM_SERVER, nullptr);
      _exit(127);
    }
    close(ends[1]);
    if (child > 0) {
      socket_ = ends[0];
    } else {
      close(ends[0]);
    }
  }

  std::optional<int> Run(const ProgramRun& run) {
    if (socket_ < 0 || !(inherited_ == Inherited())) return std::nullopt;
    std::int32_t status = 0;
    if (!SendRun(socket_, run)) {
      close(socket_);
      socket_ = -1;
      return std::nullopt;
    }
    // A run that has begun is not begun again: what it left would be in the way.
    return ReadAll(socket_, &status, sizeof(status)) ? status : kNoServer;
  }

 private:
  int socket_ = -1;  // open to the end of the process, which is how the server knows of it
  const Inherited inherited_;
};

bool SendText(int socket, const std::string& text) {
  const std::uint64_t length = text.size();
  return WriteAll(socket, &length, sizeof(length)) && WriteAll(socket, text.data(), text.size());
}

bool SendTexts(int socket, const std::vector<std::string>& texts) {
  const std::uint64_t count = texts.size();
  if (!WriteAll(socket, &count, sizeof(count))) return false;
  for (const std::string& text : texts) {
    if (!SendText(socket, text)) return false;
  }
  return true;
}

bool ReceiveText(int socket, std::string& text) {
  std::uint64_t length = 0;
  if (!ReadAll(socket, &length, sizeof(length))) return false;
  text.resize(length);
  return ReadAll(socket, text.data(), length);
}

bool ReceiveTexts(int socket, std::vector<std::string>& texts) {
  std::uint64_t count = 0;
  if (!ReadAll(socket, &count, sizeof(count))) return false;
  texts.resize(count);
  for (std::string& text : texts) {
    if (!ReceiveText(socket, text)) return false;
  }
  return true;
}

}  // namespace

bool WriteAll(int file, const void* bytes, size_t count) {
  const char* next = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t written = send(file, next, count, MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    next += written, count -= static_cast<size_t>(written);
  }
  return true;
}

bool ReadAll(int file, void* bytes, size_t count) {
  char* next = static_cast<char*>(bytes);
  while (count > 0) {
    const ssize_t got = read(file, next, count);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    next += got, count -= static_cast<size_t>(got);
  }
  return true;
}

bool SendRun(int socket, const ProgramRun& run) {
  const std::uint64_t mask = run.umask;
  return SendTexts(socket, run.args) && SendTexts(socket, run.environment) &&
         SendTexts(socket, {run.folder, run.out, run.err}) && WriteAll(socket, &mask, sizeof(mask));
}

std::optional<ProgramRun> ReceiveRun(int socket) {
  ProgramRun run;
  std::vector<std::string> places;
  std::uint64_t mask = 0;
  if (!ReceiveTexts(socket, run.args) || !ReceiveTexts(socket, run.environment) ||
      !ReceiveTexts(socket, places) || !ReadAll(socket, &mask, sizeof(mask))) {
    return std::nullopt;
  }
  run.folder = places.at(0), run.out = places.at(1), run.err = places.at(2);
  run.umask = static_cast<mode_t>(mask);
  return run;
}

std::optional<int> RunByServer(const std::vector<std::string>& args,
                               const std::filesystem::path& out, const std::filesystem::path& err) {
#ifdef DTR_SANITIZED
  // LeakSanitizer looks at exit(), and ThreadSanitizer wants no threads before a fork.
  return std::nullopt;
#endif
  static std::mutex one_run;
  const std::unique_lock lock(one_run, std::try_to_lock);
  if (!lock) return std::nullopt;
  static Server server;
  ProgramRun run;
  run.args = args;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    run.environment.emplace_back(*variable);
  }
  run.folder = std::filesystem::current_path().string();
  run.out = std::filesystem::absolute(out).string();
  run.err = std::filesystem::absolute(err).string();
  run.umask = umask(0);
  umask(run.umask);
  return server.Run(run);
}

}  // namespace dtr::testing
