#include "dtr/base/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "dtr/base/error.h"

namespace dtr {
namespace fs = std::filesystem;

std::string ReadFile(const fs::path& file, std::uintmax_t limit_bytes) {
  std::error_code error;
  std::ignore = fs::file_size(file, error);  // says why, and refuses folders, which open
  if (error) throw Error(file.string() + ": cannot be read: " + error.message());
  // The size of what is open: another file may take the name at any time.
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const auto end = static_cast<std::streamoff>(in.tellg());
  if (!in || end < 0) throw Error(file.string() + ": cannot be read");
  const auto size = static_cast<std::uintmax_t>(end);
  if (size > limit_bytes) {
    throw Error(file.string() + ": expected at most " + std::to_string(limit_bytes) +
                " bytes, found " + std::to_string(size));
  }
  std::string content(size, '\0');
  in.seekg(0);
  errno = 0;
  if (!in.read(content.data(), static_cast<std::streamsize>(size))) {
    throw Error(file.string() + ": expected " + std::to_string(size) + " bytes, found " +
                std::to_string(in.gcount()) + " that can be read" +
                (errno != 0 ? std::string(": ") + std::strerror(errno) : "") +
                "; read it again once nothing writes it, or copy it anew");
  }
  return content;
}

fs::path WithoutTrailingSlash(const fs::path& path) {
  return path.has_filename() || !path.has_relative_path() ? path : path.parent_path();
}

namespace {

// Writes and syncs; returns errno of the first failure, or 0.
int WriteAll(int fd, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = write(fd, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    content.remove_prefix(static_cast<size_t>(written));
  }
  return fsync(fd) == 0 ? 0 : errno;
}

}  // namespace

void WriteFileAtomically(const fs::path& file, std::string_view content) {
  const fs::path temporary = file.string() + ".tmp" + std::to_string(getpid());
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  int failure = fd < 0 ? errno : WriteAll(fd, content);
  if (fd >= 0 && close(fd) != 0 && failure == 0) failure = errno;
  if (failure == 0 && rename(temporary.c_str(), file.c_str()) != 0) failure = errno;
  if (failure != 0) {
    unlink(temporary.c_str());
    throw Error(file.string() + ": cannot be written: " + std::strerror(failure));
  }
}

}  // namespace dtr
