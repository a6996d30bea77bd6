// dtr/base/work_folder.h -- work that is not continued: what a killed process left of it is cleared
// away by the next one, and nothing else is.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "dtr/base/durable.h"

namespace dtr {

/// A folder in which something is made that appears under its own name when it is whole. A file
/// KIND.lock in it says what is made there and, by its lock, whether somebody is still at it. KIND
/// is a word for people too: "capture".
class WorkFolder {
 public:
  /// The usual name: `target` with ".partial" behind it, with or without a slash at its end.
  static std::filesystem::path Of(const std::filesystem::path& target);
  static std::string MarkOf(const std::string& kind) { return kind + ".lock"; }
  /// Throws UsageError unless there is nothing, an empty folder or unfinished work of this kind:
  /// it may be somebody's interrupted build.
  static void RejectForeign(const std::filesystem::path& folder, const std::string& kind);
  /// The lock of a folder of this kind. Throws UsageError while another process has it.
  static FileLock Lock(const std::filesystem::path& folder, const std::string& kind);
  /// Whether something is at `target` that stands in the way of Become(). Only a folder does not
  /// that a process made as `kind` and was killed before it took its mark away: it is whole, and
  /// nobody was told of it.
  static bool IsTaken(const std::filesystem::path& target, const std::string& kind);
  /// Removes a folder of this kind that a killed process left and no other one works in.
  static void ClearLeft(const std::filesystem::path& folder, const std::string& kind) noexcept;

  /// Makes the folder, or clears what was left in it. Throws UsageError where it is not ours or
  /// another process is at work in it, Error where it cannot be made or cleared.
  WorkFolder(std::filesystem::path folder, std::string kind);
  /// Removes it, unless it became something.
  ~WorkFolder();
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  /// Everything in it to the disk, one rename, and the mark goes. Where a killed process came as
  /// far as the rename (IsTaken), its folder stays and loses its mark; throws UsageError where that
  /// holds anything else than this one.
  void Become(const std::filesystem::path& target);
  /// The last two steps of it apart, for who must do something between them.
  void MoveTo(const std::filesystem::path& target);
  void Unmark();

 private:
  std::filesystem::path path_;
  std::string kind_;
  std::optional<FileLock> lock_;
  bool moved_ = false;
};

}  // namespace dtr
