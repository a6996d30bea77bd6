#include "dtr/base/work_folder.h"

#include <system_error>
#include <utility>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr {
namespace fs = std::filesystem;

fs::path WorkFolder::Of(const fs::path& target) {
  return ResolveLinks(WithoutTrailingSlash(target)).string() + ".partial";
}

void WorkFolder::RejectForeign(const fs::path& folder, const std::string& kind) {
  const auto is = [](const fs::path& path, fs::file_type type) {
    return fs::symlink_status(path).type() == type;
  };
  if (is(folder, fs::file_type::not_found)) return;
  const bool is_folder = is(folder, fs::file_type::directory);
  if (is_folder && (fs::is_empty(folder) || is(folder / MarkOf(kind), fs::file_type::regular))) {
    return;
  }
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
    ClearFolder(path_, MarkOf(kind_));
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
  const fs::path place = ResolveLinks(WithoutTrailingSlash(target));
  Rename(path_, place);
  moved_ = true;
  path_ = place;
  SyncFolder(path_.has_parent_path() ? path_.parent_path() : ".");
}

void WorkFolder::Unmark() {
  try {
    RemoveFile(path_ / MarkOf(kind_));
  } catch (const fs::filesystem_error& error) {
    throw Error(path_.string() + ": its mark cannot be deleted: " + error.code().message());
  }
}

void WorkFolder::Become(const fs::path& target) {
  SyncTree(path_);
  MoveTo(target);
  Unmark();
}

}  // namespace dtr
