#include "pipeline/batch/detail/batch_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>

#include "dtr/base/error.h"
#include "pipeline/batch/detail/batch_files.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr char kLock[] = "batch.lock", kLogs[] = "logs";

// Of the file itself where it is a link; nothing where there is none.
std::optional<struct stat> About(const fs::path& file) {
  struct stat about {};
  if (lstat(file.c_str(), &about) == 0) return about;
  if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
  throw Error(fmt::format("{}: cannot be looked at: {}", file.string(), std::strerror(errno)));
}

[[noreturn]] void RejectForeign(const fs::path& folder) {
  throw UsageError(folder.string() +
                   ": expected nothing or the folder of a batch, found something else; move it "
                   "away");
}

// Of a killed batch there may be no record yet.
bool HoldsBatch(const fs::path& folder) {
  const auto is_file = [&](const char* name) {
    const auto about = About(folder / name);
    return about && S_ISREG(about->st_mode);
  };
  return is_file(kBatchFile) || is_file(kLock) || IsEmptyFolder(folder);
}

void RequireOwner(const fs::path& file, const struct stat& about) {
  if (about.st_uid != geteuid()) {
    throw UsageError(
        fmt::format("{}: belongs to the user of number {}, this is number {}: what it says is done "
                    "for its owner alone; choose another name",
                    file.string(), about.st_uid, geteuid()));
  }
  if ((about.st_mode & S_IWOTH) != 0) {
    throw UsageError(
        fmt::format("{}: every user may write there, and it decides what the batch does; look "
                    "through it and take that right away (chmod -R o-w), or delete it and begin "
                    "the batch again, what was built stays",
                    file.string()));
  }
}

void MakeFolder(const fs::path& folder) {
  if (mkdir(folder.c_str(), 0755) == 0 || (errno == EEXIST && fs::is_directory(folder))) return;
  throw Error(folder.string() + ": cannot be made: " + std::strerror(errno));
}

}  // namespace

std::string RequireOwnBatch(const fs::path& set) {
  const fs::path folder = BatchFolder(set);
  const auto about = About(folder);
  if (!about) return "";
  if (!S_ISDIR(about->st_mode)) RejectForeign(folder);
  RequireOwner(folder, *about);
  if (!HoldsBatch(folder)) RejectForeign(folder);
  bool group_writes = (about->st_mode & S_IWGRP) != 0;
  if (const auto logs = About(folder / kLogs)) {
    if (!S_ISDIR(logs->st_mode)) RejectForeign(folder / kLogs);
    RequireOwner(folder / kLogs, *logs);
    group_writes = group_writes || (logs->st_mode & S_IWGRP) != 0;
  }
  if (const auto record = About(folder / kBatchFile)) {
    if (!S_ISREG(record->st_mode)) RejectForeign(folder);
    RequireOwner(folder / kBatchFile, *record);
  }
  if (!group_writes) return "";
  return fmt::format(
      "WARNING: {}: its group may write there, and it decides what the batch does; where you do "
      "not mean that, chmod -R g-w",
      folder.string());
}

FileLock LockBatch(const fs::path& set) {
  const fs::path folder = BatchFolder(set);
  std::error_code error;
  fs::create_directories(folder.parent_path(), error);
  if (error) throw Error(folder.string() + ": cannot be made: " + error.message());
  MakeFolder(folder);
  RequireOwnBatch(set);  // another user may have been first
  auto lock = FileLock::Try(folder / kLock);
  if (!lock) {
    throw UsageError(folder.string() + ": another dtr batch works on this set; wait for it");
  }
  MakeFolder(folder / kLogs);
  return std::move(*lock);
}

}  // namespace dtr::pipeline
