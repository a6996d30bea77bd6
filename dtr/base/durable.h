// dtr/base/durable.h -- what must hold when the machine stops at any moment: files that are on the
// disk before something vouches for them, temporary files that are known as such, locks that end
// with their process.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace dtr {

/// Waits until the content of `file` is on the disk. Throws Error when that fails.
void SyncFile(const std::filesystem::path& file);
/// The same for the names in a folder: a rename is on the disk only when its folder is. File
/// systems that cannot sync folders are left to what they do.
void SyncFolder(const std::filesystem::path& folder);
/// SyncFile and SyncFolder for everything below `root`, and for itself; links are not followed.
void SyncTree(const std::filesystem::path& root);

/// Throws Error naming both where the system rejects.
void Rename(const std::filesystem::path& from, const std::filesystem::path& to);

/// Copies content, not permissions to the letter: the copy can be written by its owner even where
/// the original cannot. As WriteFileAtomically, `to` has the old content or all of the new one,
/// which is on the disk; a file that may only be read is replaced too. Throws Error.
void CopyFileAtomically(const std::filesystem::path& from, const std::filesystem::path& to);

/// Adds `record` at the end of `file`, which is made where there is none. It is on the disk when
/// this returns; where it cannot be, the file is as it was. Throws Error. A process that is killed
/// may leave a part of the record: its reader must know a whole one.
void AppendDurably(const std::filesystem::path& file, std::string_view record);

/// A name beside `file` that no other process writes to now, on this machine or another one that
/// shares the folder; IsTemporaryFile knows it.
std::filesystem::path TemporaryFor(const std::filesystem::path& file);
/// True for what WriteFileAtomically and CopyFileAtomically leave when they are killed:
/// NAME.tmp and a number.
bool IsTemporaryFile(const std::filesystem::path& file);
/// Before work in a folder goes on: throws UsageError naming a symbolic link in it that is not
/// `ours` (asked with its path below `folder`), or the folder itself where it is one. Work would be
/// written and deleted where such a link leads.
void RejectLinks(
    const std::filesystem::path& folder,
    const std::function<bool(const std::filesystem::path& inside)>& ours = [](const auto&) {
      return false;
    });

/// True for a folder in which nothing is; false for anything else and for nothing.
bool IsEmptyFolder(const std::filesystem::path& folder);

/// Before a folder is replaced: throws UsageError naming the first entry (by name) that is not
/// `ours`, as somebody's notes would go with the folder. What IsTemporaryFile knows, and what
/// desktops leave everywhere (.DS_Store, Thumbs.db), is nobody's.
void RejectForeign(const std::filesystem::path& folder,
                   const std::function<bool(const std::string& name)>& ours);

/// Held by one process at a time, or shared; the system releases it when the process ends, however
/// it ends.
class FileLock {
 public:
  enum class Kind {
    kAlone,
    kShared,  ///< several processes may have it, as long as none has it alone
  };
  /// Empty when another process has the lock. Makes the file where there is none; throws Error
  /// where it cannot be opened, or where the file system has no locks.
  static std::optional<FileLock> Try(const std::filesystem::path& file, Kind kind = Kind::kAlone);
  ~FileLock();
  FileLock(FileLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileLock& operator=(FileLock&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }

 private:
  explicit FileLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace dtr
