#include "dtr/base/files.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "dtr/base/delete.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr {
namespace fs = std::filesystem;

namespace {

// A new file: whatever an earlier process of our number left under its name goes first.
void WriteNew(const fs::path& file, std::string_view content) {
  TryRemoveFile(file);
  const OpenFile out(file, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, 0644);
  WriteAll(out, content);
  Done(fsync(out.fd()));
}

}  // namespace

std::string ReadFile(const fs::path& file, std::uintmax_t limit_bytes) {
  const OpenFile in = OpenToRead(file);
  struct stat about;
  if (fstat(in.fd(), &about) != 0) {
    throw Error(file.string() + ": cannot be read: " + std::strerror(errno));
  }
  const auto size = static_cast<std::uintmax_t>(about.st_size);
  if (size > limit_bytes) {
    throw Error(file.string() + ": expected at most " + std::to_string(limit_bytes) +
                " bytes, found " + std::to_string(size));
  }
  std::string content(size, '\0');
  size_t found = 0;
  int failure = 0;
  while (found < size) {
    const ssize_t got = read(in.fd(), content.data() + found, size - found);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) failure = errno;
    if (got <= 0) break;
    found += static_cast<size_t>(got);
  }
  if (found < size) {
    throw Error(file.string() + ": expected " + std::to_string(size) + " bytes, found " +
                std::to_string(found) + " that can be read" +
                (failure != 0 ? std::string(": ") + std::strerror(failure) : "") +
                "; read it again once nothing writes it, or copy it again");
  }
  return content;
}

fs::path WithoutTrailingSlash(const fs::path& path) {
  return path.has_filename() || !path.has_relative_path() ? path : path.parent_path();
}

bool IsWrittenInPlace(const fs::path& file) {
  std::error_code ignored;
  const std::string whole = fs::absolute(file, ignored).lexically_normal().string();
  for (const char* stream : {"/dev/fd/", "/dev/std", "/proc/"}) {
    if (whole.starts_with(stream)) return true;  // may lead to a file that somebody else has open
  }
  const fs::file_status there = fs::status(file, ignored);
  return fs::exists(there) && !fs::is_regular_file(there) && !fs::is_directory(there);
}

fs::path ResolveLinks(const fs::path& path) {
  constexpr int kMaxLinks = 40;  // as the system has it (path_resolution(7))
  fs::path resolved = WithoutTrailingSlash(path);
  for (int i = 0; i < kMaxLinks; ++i) {
    std::error_code error;
    if (!fs::is_symlink(resolved, error)) return i == 0 ? path : resolved;
    const fs::path target = fs::read_symlink(resolved, error);
    if (error) break;
    resolved = WithoutTrailingSlash(resolved.parent_path() / target);
  }
  throw Error(path.string() + ": cannot be written: it is a link that leads nowhere");
}

void WriteFileAtomically(const fs::path& file, std::string_view content) {
  try {
    if (IsWrittenInPlace(file)) {
      const OpenFile out(file, O_WRONLY | O_APPEND);  // standard output may be a file
      return WriteAll(out, content);
    }
    const fs::path target = ResolveLinks(file);
    const fs::path temporary = TemporaryFor(target);
    try {
      WriteNew(temporary, content);
      Done(rename(temporary.c_str(), target.c_str()));
    } catch (const std::system_error&) {
      TryRemoveFile(temporary);
      throw;
    }
  } catch (const std::system_error& failure) {
    throw Error(file.string() + ": cannot be written: " + failure.code().message());
  }
}

void PublishFile(const fs::path& made, const fs::path& target) {
  const fs::path place = ResolveLinks(target);
  if (IsWrittenInPlace(target)) {
    throw Error(target.string() +
                ": cannot be written: this output must be a file; choose a name "
                "for one");
  }
  SyncFile(made);
  Rename(made, place);
  SyncFolder(place.has_parent_path() ? place.parent_path() : ".");
}

}  // namespace dtr
