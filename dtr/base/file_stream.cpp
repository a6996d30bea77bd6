#include "dtr/base/file_stream.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"

namespace dtr {
namespace {

constexpr size_t kBufferBytes = 1 << 20;

// What a system call failed with, as everywhere a file is written.
template <typename Function>
void Naming(const std::filesystem::path& file, const Function& function) {
  try {
    function();
  } catch (const std::system_error& error) {
    throw Error(file.string() + ": cannot be written: " + error.code().message());
  }
}

}  // namespace

FileStream::FileStream(std::filesystem::path file) : file_(std::move(file)) {
  TryRemoveFile(file_);
  Naming(file_, [&] { open_.emplace(file_, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, 0666); });
  buffer_.reserve(kBufferBytes);
}

void FileStream::Write(std::string_view bytes) {
  buffer_ += bytes;
  if (buffer_.size() >= kBufferBytes) Flush();
}

void FileStream::Flush() {
  Naming(file_, [&] { WriteAll(*open_, buffer_); });
  buffer_.clear();
}

void FileStream::Replace(std::string_view bytes) {
  Flush();
  Naming(file_, [&] {
    Done(lseek(open_->fd(), 0, SEEK_SET));
    WriteAll(*open_, bytes);
    Done(lseek(open_->fd(), 0, SEEK_END));
  });
}

}  // namespace dtr
