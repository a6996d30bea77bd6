#include "dtr/base/work_folder.h"

#include <system_error>
#include <utility>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr {
namespace fs = std::filesystem;
namespace {

void Clear(const fs::path& folder, const std::string& but) {
  std::vector<fs::path> stale;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename() != but) stale.push_back(entry.path());
  }
  for (const fs::path& path : stale) fs::remove_all(path);
}

}  // namespace

fs::path WorkFolder::Of(const fs::path& target) {
  return WithoutTrailingSlash(target).string() + ".partial";
}

void WorkFolder::RejectForeign(const fs::path& folder, const std::string& kind) {
  if (!fs::exists(fs::symlink_status(folder)) || IsEmptyFolder(folder)) return;
  if (fs::is_regular_file(folder / MarkOf(kind))) return;
  throw UsageError(folder.string() + ": expected nothing or an unfinished " + kind +
                   ", found something else; move it away");
}

FileLock WorkFolder::Lock(const fs::path& folder, const std::string& kind) {
  if (auto lock = FileLock::Try(folder / MarkOf(kind))) return std::move(*lock);
  throw UsageError(folder.string() + ": another process is writing this " + kind + "; wait for it");
}

WorkFolder::WorkFolder(fs::path folder, std::string kind)
    : path_(std::move(folder)), kind_(std::move(kind)) {
  try {
    RejectForeign(path_, kind_);
    fs::create_directories(path_);
    lock_ = Lock(path_, kind_);
    Clear(path_, MarkOf(kind_));
  } catch (const fs::filesystem_error& error) {
    throw Error(path_.string() + ": cannot be written: " + error.code().message());
  }
}

WorkFolder::~WorkFolder() {
  if (moved_) return;
  try {
    RemoveFolder(path_, MarkOf(kind_));
  } catch (const fs::filesystem_error&) {
    // The next run clears it away.
  }
}

void WorkFolder::MoveTo(const fs::path& target) {
  Rename(path_, target);
  moved_ = true;
  path_ = WithoutTrailingSlash(target);
  SyncFolder(path_.has_parent_path() ? path_.parent_path() : ".");
}

void WorkFolder::Unmark() {
  std::error_code error;
  fs::remove(path_ / MarkOf(kind_), error);
  if (error) throw Error(path_.string() + ": its mark cannot be deleted: " + error.message());
}

void WorkFolder::Become(const fs::path& target) {
  SyncTree(path_);
  MoveTo(target);
  Unmark();
}

}  // namespace dtr
