#include "dtr/base/durable.h"

#include <sys/file.h>
#include <sys/stat.h>
#include <sys/utsname.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <set>
#include <string_view>
#include <system_error>
#include <tuple>
#include <vector>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr {
namespace fs = std::filesystem;
namespace {

// errno of the first failure, or 0.
int Sync(const fs::path& path, int flags) {
  const int fd = open(path.c_str(), flags | O_CLOEXEC);
  if (fd < 0) return errno;
  const int failure = fsync(fd) == 0 ? 0 : errno;
  close(fd);
  return failure;
}

[[noreturn]] void Fail(const fs::path& file, const std::string& what, const std::string& why) {
  throw Error(file.string() + ": " + what + ": " + why);
}

// std::filesystem::copy_file calls a full disk an input/output error.
void CopyContent(const fs::path& from, const fs::path& to) {
  const OpenFile in = OpenToRead(from);
  struct stat about;
  Done(fstat(in.fd(), &about));
  const OpenFile out(to, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, S_IRUSR | S_IWUSR);
  std::vector<char> buffer(size_t{1} << 18);
  while (const auto size = static_cast<size_t>(Done(read(in.fd(), buffer.data(), buffer.size())))) {
    WriteAll(out, {buffer.data(), size});
  }
  constexpr mode_t kPermissions = 0777;
  Done(fchmod(out.fd(), (about.st_mode & kPermissions) | S_IWUSR));
  Done(fsync(out.fd()));
}

}  // namespace

void SyncFile(const fs::path& file) {
  if (const int failure = Sync(file, O_RDONLY); failure != 0) {
    Fail(file, "cannot be written", std::strerror(failure));
  }
}

void SyncFolder(const fs::path& folder) {
  const int failure = Sync(folder, O_RDONLY | O_DIRECTORY);
  // Some network file systems cannot sync folders; their renames are as safe as they get.
  if (failure != 0 && failure != EINVAL && failure != ENOTSUP) {
    Fail(folder, "cannot be synced to disk", std::strerror(failure));
  }
}

void SyncTree(const fs::path& root) {
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.is_symlink()) continue;
    if (entry.is_regular_file()) SyncFile(entry.path());
    if (entry.is_directory()) SyncFolder(entry.path());
  }
  SyncFolder(root);
}

void Rename(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (error) Fail(from, "cannot be renamed to " + to.string(), error.message());
}

void CopyFileAtomically(const fs::path& from, const fs::path& to) {
  const fs::path temporary = TemporaryFor(to);
  try {
    TryRemoveFile(temporary);  // of an earlier process of our number, perhaps to be read only
    try {
      CopyContent(from, temporary);
    } catch (const std::system_error& failure) {
      Fail(to, "cannot be copied from " + from.string(), failure.code().message());
    }
    Rename(temporary, to);
  } catch (...) {
    TryRemoveFile(temporary);
    throw;
  }
}

void AppendDurably(const fs::path& file, std::string_view record) {
  try {
    const OpenFile out(file, O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW, 0644);
    const off_t before = Done(lseek(out.fd(), 0, SEEK_END));
    try {
      WriteAll(out, record);
      Done(fsync(out.fd()));
    } catch (const std::system_error&) {
      std::ignore = ftruncate(out.fd(), before);  // what comes next must not follow half a record
      throw;
    }
  } catch (const std::system_error& failure) {
    Fail(file, "cannot be written", failure.code().message());
  }
}

fs::path TemporaryFor(const fs::path& file) {
  // Process numbers are of one machine; its name tells machines apart.
  static const std::uint32_t machine = [] {
    utsname name{};
    uname(&name);
    constexpr std::uint32_t kOffset = 2166136261u, kPrime = 16777619u;  // FNV-1a
    std::uint32_t hash = kOffset;
    for (const char c : std::string_view(name.nodename)) {
      hash = (hash ^ static_cast<unsigned char>(c)) * kPrime;
    }
    return hash;
  }();
  return file.string() + ".tmp" + std::to_string(machine) + std::to_string(getpid());
}

bool IsTemporaryFile(const fs::path& file) {
  const std::string name = file.filename().string();
  const size_t end = name.find_last_not_of("0123456789");
  constexpr size_t kLength = 4;  // ".tmp"
  return end != std::string::npos && end + 1 < name.size() && end + 1 >= kLength &&
         name.compare(end + 1 - kLength, kLength, ".tmp") == 0;
}

void RejectLinks(const fs::path& folder, const std::function<bool(const fs::path&)>& ours) {
  const auto reject = [](const fs::path& link) {
    throw UsageError(
        link.string() +
        ": work in progress must not be a symbolic link, which leads out of its folder; "
        "move it away");
  };
  if (fs::is_symlink(folder)) reject(folder);
  if (!fs::is_directory(folder)) return;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_symlink() && !ours(entry.path().lexically_relative(folder))) reject(entry.path());
  }
}

bool IsEmptyFolder(const fs::path& folder) {
  return fs::is_directory(folder) && fs::is_empty(folder);
}

namespace {

// What desktops and network disks leave in every folder: nobody's work.
bool IsLitter(const std::string& name) {
  for (const char* litter : {".DS_Store", ".directory", "Thumbs.db", "desktop.ini"}) {
    if (name == litter) return true;
  }
  return name.starts_with("._") || name.starts_with(".nfs");
}

}  // namespace

void RejectForeign(const fs::path& folder, const std::function<bool(const std::string&)>& ours) {
  std::set<std::string> foreign;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!ours(name) && !IsLitter(name) && !IsTemporaryFile(entry.path())) foreign.insert(name);
  }
  if (foreign.empty()) return;
  throw UsageError(
      folder.string() +
      ": expected nothing in the folder to be replaced but what was made there, found " +
      *foreign.begin() + "; move it away");
}

std::optional<FileLock> FileLock::Try(const fs::path& file, Kind kind) {
  const int fd = open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644);
  if (fd < 0) Fail(file, "cannot be opened", std::strerror(errno));
  FileLock lock(fd);
  if (flock(fd, (kind == Kind::kAlone ? LOCK_EX : LOCK_SH) | LOCK_NB) == 0) return lock;
  if (errno != EWOULDBLOCK) Fail(file, "cannot be locked", std::strerror(errno));
  return std::nullopt;
}

FileLock::~FileLock() {
  if (fd_ >= 0) close(fd_);
}

}  // namespace dtr
