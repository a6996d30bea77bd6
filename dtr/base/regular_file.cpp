#include "dtr/base/regular_file.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "dtr/base/error.h"

namespace dtr {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void Fail(const fs::path& file, const std::string& why) {
  throw Error(file.string() + ": cannot be read: " + why);
}

const char* KindOf(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

}  // namespace

OpenFile OpenToRead(const fs::path& file) {
  try {
    OpenFile open(file, O_RDONLY | O_NONBLOCK);  // of a pipe nobody may be writing
    struct stat about;
    Done(fstat(open.fd(), &about));
    if (!S_ISREG(about.st_mode))
      Fail(file, "it must be a file, and is " + std::string(KindOf(about.st_mode)));
    return open;
  } catch (const std::system_error& failure) {
    Fail(file, failure.code().message());
  }
}

void RequireRegularFile(const fs::path& file) { (void)OpenToRead(file); }

std::ifstream StreamOf(const fs::path& file) {
  RequireRegularFile(file);
  std::ifstream in(file, std::ios::binary);
  if (!in) Fail(file, std::strerror(errno));
  return in;
}

}  // namespace dtr
