#include "dtr/base/delete.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <memory>
#include <system_error>
#include <vector>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"

namespace dtr {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void Fail(const fs::path& path, int error) {
  throw fs::filesystem_error("cannot be deleted", path,
                             std::error_code(error, std::generic_category()));
}

using Folder = std::unique_ptr<DIR, int (*)(DIR*)>;

// Null where `name` in the folder `parent` is no folder, a link to one included; errno says why.
Folder OpenFolder(int parent, const char* name) {
  const int fd = openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  DIR* const open = fd < 0 ? nullptr : fdopendir(fd);
  if (open == nullptr && fd >= 0) close(fd);
  return {open, closedir};
}

// Names are read first: a folder that changes while it is read may skip some.
std::vector<std::string> NamesIn(DIR* folder) {
  std::vector<std::string> names;
  while (const dirent* entry = readdir(folder)) {
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
  }
  return names;
}

// `shown` is the path of `name` for messages.
void RemoveAt(int parent, const std::string& name, const fs::path& shown) {
  if (unlinkat(parent, name.c_str(), 0) == 0 || errno == ENOENT) return;
  const int why = errno;  // EISDIR on Linux, EPERM by POSIX
  struct stat about;
  if (fstatat(parent, name.c_str(), &about, AT_SYMLINK_NOFOLLOW) != 0) {
    if (errno == ENOENT) return;
    Fail(shown, errno);
  }
  if (!S_ISDIR(about.st_mode)) Fail(shown, why);
  {
    const Folder folder = OpenFolder(parent, name.c_str());
    if (!folder) Fail(shown, errno);
    for (const std::string& entry : NamesIn(folder.get())) {
      RemoveAt(dirfd(folder.get()), entry, shown / entry);
    }
  }
  if (unlinkat(parent, name.c_str(), AT_REMOVEDIR) != 0 && errno != ENOENT) Fail(shown, errno);
}

Folder OpenOwnFolder(const fs::path& folder) {
  Folder open = OpenFolder(AT_FDCWD, folder.c_str());
  if (!open) Fail(folder, errno);
  return open;
}

}  // namespace

void RemoveFile(const fs::path& file) {
  if (unlink(file.c_str()) == 0 || errno == ENOENT) return;
  const int why = errno;
  if (rmdir(file.c_str()) == 0) return;
  Fail(file, errno == ENOTDIR ? why : errno);
}

bool TryRemoveFile(const fs::path& file) noexcept {
  return unlink(file.c_str()) == 0 || errno == ENOENT;
}

void RemoveTree(const fs::path& path) {
  // "a/" would name what a link `a` leads to.
  const fs::path whole = path.has_filename() ? path : path.parent_path();
  RemoveAt(AT_FDCWD, whole.string(), whole);
}

bool TryRemoveTree(const fs::path& path) noexcept {
  try {
    RemoveTree(path);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

void ClearFolder(const fs::path& folder, const std::string& kept) {
  const Folder open = OpenOwnFolder(folder);
  for (const std::string& name : NamesIn(open.get())) {
    if (name != kept) RemoveAt(dirfd(open.get()), name, folder / name);
  }
}

void RemoveFolder(const fs::path& folder, const std::string& mark) {
  const Folder open = OpenOwnFolder(folder);
  const std::vector<std::string> names = NamesIn(open.get());
  struct stat about;
  const bool marked = fstatat(dirfd(open.get()), mark.c_str(), &about, AT_SYMLINK_NOFOLLOW) == 0 &&
                      S_ISREG(about.st_mode);
  if (!marked && !names.empty()) Fail(folder, EPERM);
  for (const std::string& name : names) {
    if (name != mark) RemoveAt(dirfd(open.get()), name, folder / name);
  }
  RemoveAt(dirfd(open.get()), mark, folder / mark);
  if (rmdir(folder.c_str()) != 0 && errno != ENOENT) Fail(folder, errno);
}

void RemoveTemporaryFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  if (fs::is_symlink(folder, error)) {
    throw Error(folder.string() + ": temporary files in it cannot be deleted: it is a link");
  }
  fs::recursive_directory_iterator entries(folder, error);
  for (; !error && entries != fs::recursive_directory_iterator(); entries.increment(error)) {
    if (entries->symlink_status().type() == fs::file_type::regular &&
        IsTemporaryFile(entries->path())) {
      files.push_back(entries->path());
    }
  }
  for (size_t i = 0; !error && i < files.size(); ++i) {
    if (unlink(files[i].c_str()) != 0 && errno != ENOENT) {
      error = std::error_code(errno, std::generic_category());
    }
  }
  if (error) {
    throw Error(folder.string() + ": temporary files in it cannot be deleted: " + error.message());
  }
}

}  // namespace dtr
