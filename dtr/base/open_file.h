// dtr/base/open_file.h -- file descriptors.
#pragma once
#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

namespace dtr {

/// What a system call returned. Throws std::system_error where that was a failure.
inline ssize_t Done(ssize_t result) {
  if (result < 0) throw std::system_error(errno, std::generic_category());
  return result;
}

/// Closed when it goes, and in children that run programs.
class OpenFile {
 public:
  OpenFile(const std::filesystem::path& file, int flags, mode_t mode = 0)
      : fd_(static_cast<int>(Done(open(file.c_str(), flags | O_CLOEXEC, mode)))) {}
  ~OpenFile() {
    if (fd_ >= 0) close(fd_);
  }
  OpenFile(OpenFile&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

/// Throws std::system_error.
inline void WriteAll(const OpenFile& file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = write(file.fd(), content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    content.remove_prefix(static_cast<size_t>(Done(written)));
  }
}

}  // namespace dtr
