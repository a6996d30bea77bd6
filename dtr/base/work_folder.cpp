#include "dtr/base/work_folder.h"

#include <map>
#include <system_error>
#include <utility>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/hash.h"

namespace dtr {
namespace fs = std::filesystem;
namespace {

bool Is(const fs::path& path, fs::file_type type) {
  return fs::symlink_status(path).type() == type;
}

bool IsMarked(const fs::path& folder, const std::string& kind) {
  return Is(folder, fs::file_type::directory) &&
         Is(folder / WorkFolder::MarkOf(kind), fs::file_type::regular);
}

// Hashes of files by their names, none of folders, and what else there is by its kind.
std::map<fs::path, std::string> ContentsOf(const fs::path& folder) {
  std::map<fs::path, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::file_type type = entry.symlink_status().type();
    contents[entry.path().lexically_relative(folder)] =
        type == fs::file_type::regular     ? Sha256OfFile(entry.path())
        : type == fs::file_type::directory ? ""
                                           : "something else";
  }
  return contents;
}

}  // namespace

fs::path WorkFolder::Of(const fs::path& target) {
  return ResolveLinks(WithoutTrailingSlash(target)).string() + ".partial";
}

void WorkFolder::RejectForeign(const fs::path& folder, const std::string& kind) {
  if (Is(folder, fs::file_type::not_found) || IsMarked(folder, kind)) return;
  if (Is(folder, fs::file_type::directory) && fs::is_empty(folder)) return;
  throw UsageError(folder.string() + ": expected nothing or an unfinished " + kind +
                   ", found something else; move it away");
}

FileLock WorkFolder::Lock(const fs::path& folder, const std::string& kind) {
  if (auto lock = FileLock::Try(folder / MarkOf(kind))) return std::move(*lock);
  throw UsageError(folder.string() + ": another process is writing this " + kind + "; wait for it");
}

bool WorkFolder::IsTaken(const fs::path& target, const std::string& kind) {
  const fs::path place = ResolveLinks(WithoutTrailingSlash(target));
  return !Is(place, fs::file_type::not_found) && !IsMarked(place, kind);
}

void WorkFolder::ClearLeft(const fs::path& folder, const std::string& kind) noexcept {
  try {
    if (!IsMarked(folder, kind)) return;
    if (const auto lock = FileLock::Try(folder / MarkOf(kind))) RemoveFolder(folder, MarkOf(kind));
  } catch (const std::exception&) {
    // It only takes room.
  }
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
  const fs::path place = ResolveLinks(WithoutTrailingSlash(target));
  if (IsMarked(place, kind_)) {
    const FileLock nobody_at_work = Lock(place, kind_);
    if (ContentsOf(place) != ContentsOf(path_)) {
      throw UsageError(place.string() +
                       ": exists already, with other files than this command makes; choose another "
                       "name");
    }
    RemoveFile(place / MarkOf(kind_));
    return;
  }
  SyncTree(path_);
  MoveTo(target);
  Unmark();
}

}  // namespace dtr
