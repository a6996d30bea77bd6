// tests/cli/program_server.h -- `dtr` started once for many runs. Most of a short run with images
// is the loader's: 0.4 s for more than 300 shared libraries. A server, which links OpenImageIO,
// loads them once and forks for every run.
#pragma once
#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace dtr::testing {

/// Runs `dtr ARGS...` to its end with this process's environment, folder and umask, its outputs
/// in files; gives the status as waitpid does. Empty where only a start of its own is the same
/// thing: after the user, a limit or the mounts of this process changed, or while another thread
/// runs one.
std::optional<int> RunByServer(const std::vector<std::string>& args,
                               const std::filesystem::path& out, const std::filesystem::path& err);

/// What the server is asked, and how both sides write it: each text's length, then the text.
struct ProgramRun {
  std::vector<std::string> args, environment;
  std::string folder, out, err;
  mode_t umask = 0;
};
bool SendRun(int socket, const ProgramRun& run);
/// Empty at the end of the connection.
std::optional<ProgramRun> ReceiveRun(int socket);

/// All bytes, or false.
bool WriteAll(int file, const void* bytes, size_t count);
bool ReadAll(int file, void* bytes, size_t count);

/// The descriptor at which a server finds its connection.
inline constexpr int kServerSocket = 3;

}  // namespace dtr::testing
