#include "dtr/base/temporary_folder.h"

#include <sys/file.h>
#include <sys/stat.h>

#include <cstdlib>
#include <system_error>
#include <vector>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/open_file.h"

namespace dtr {
namespace fs = std::filesystem;
namespace {

enum class Locked { kYes, kBySomebody, kCannot };

Locked Lock(const OpenFile& folder) {
  if (flock(folder.fd(), LOCK_EX | LOCK_NB) == 0) return Locked::kYes;
  return errno == EWOULDBLOCK ? Locked::kBySomebody : Locked::kCannot;
}

std::unique_ptr<OpenFile> OpenFolder(const fs::path& folder) {
  return std::make_unique<OpenFile>(folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW);
}

// Ours alone: in a folder that all may write to anybody can give such a name.
bool IsOurs(const OpenFile& folder) {
  struct stat about;
  return fstat(folder.fd(), &about) == 0 && about.st_uid == geteuid();
}

// Folders of this prefix whose process is gone. What cannot be removed costs room, never the work.
void ClearLeftOver(const fs::path& parent, const std::string& prefix) {
  std::error_code error;
  std::vector<fs::path> candidates;
  fs::directory_iterator entries(parent, error);
  for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
    if (entries->path().filename().string().starts_with(prefix)) {
      candidates.push_back(entries->path());
    }
  }
  for (const fs::path& folder : candidates) {
    try {
      const auto open = OpenFolder(folder);
      if (IsOurs(*open) && Lock(*open) == Locked::kYes) TryRemoveTree(folder);
    } catch (const std::system_error&) {
      continue;  // gone meanwhile, or none that we may open
    }
  }
}

bool IsStillThere(const OpenFile& open, const fs::path& folder) {
  struct stat a, b;
  return fstat(open.fd(), &a) == 0 && stat(folder.c_str(), &b) == 0 && a.st_ino == b.st_ino &&
         a.st_dev == b.st_dev;
}

}  // namespace

TemporaryFolder::TemporaryFolder(const fs::path& parent, const std::string& prefix) {
  ClearLeftOver(parent, prefix);
  std::string name;
  try {
    do {  // until no other process took it for left over before it was locked
      name = (parent / (prefix + "XXXXXX")).string();
      Done(mkdtemp(name.data()) == nullptr ? -1 : 0);
      try {
        lock_ = OpenFolder(name);
      } catch (const std::system_error& gone) {
        if (gone.code().value() != ENOENT) throw;
        continue;
      }
    } while (!lock_ || Lock(*lock_) == Locked::kBySomebody || !IsStillThere(*lock_, name));
  } catch (const std::system_error& failure) {
    throw Error(name +
                ": expected to create a temporary folder, found: " + failure.code().message() +
                "; choose another folder, or set TMPDIR to a folder that can be written");
  }
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() { TryRemoveTree(path_); }

}  // namespace dtr
