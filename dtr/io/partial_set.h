// dtr/io/partial_set.h -- internal to dtr/io: the folder in which a set is written, its lock, and
// how it takes its place.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "dtr/base/durable.h"
#include "dtr/base/error.h"

namespace dtr::io {

inline constexpr char kWork[] = "work";
inline constexpr char kSparseFile[] = "sparse.bin";
inline constexpr const char* kPixelFolders[] = {"images", "mask",  "depth", "completed", "sigma",
                                                "mesh",   "still", "video", "held_out"};
inline constexpr std::uintmax_t kRecordLimitBytes = 1 << 24;

// The file system's own errors, as ours: they name the file already.
template <typename Function>
auto AsError(const Function& function) {
  try {
    return function();
  } catch (const std::filesystem::filesystem_error& error) {
    throw Error(std::string("set cannot be written: ") + error.what());
  }
}

/// A set on its way: NAME.partial until it is whole (docs/FORMAT.md, "Safety"). All methods throw
/// Error, UsageError or std::filesystem::filesystem_error.
struct PartialSet {
  PartialSet(const std::filesystem::path& set, bool force);

  std::filesystem::path target, partial, aside, done_work;
  bool force = false, resumed = false, finished = false;
  bool joined = false;  ///< beside other processes
  std::optional<FileLock> lock;

  /// What a run left that was cut off on its way into place goes back.
  void Recover() const;
  /// `target` is free, or a set that may be replaced.
  void ExpectReplaceable() const;
  /// A run that was cut off half-way into place left something beside it.
  bool WasCutOff() const;
  /// Makes the folder or goes on in it, alone. `fingerprint_json`: see SetWriter.
  void Open(const std::string& fingerprint_json);
  /// Goes on in a folder that another process has made.
  void Join(const std::string& fingerprint_json);
  /// io::HandOver of this folder (hand_over.h).
  void HandOver(const std::string& from_json, const std::string& to_json) const;
  /// Renames the folder to `target`, and what was there aside and away.
  void MoveIntoPlace();
  /// Takes the folder away where nothing was done in it.
  void RemoveUnused() const;

 private:
  void RejectLinksBeside() const;
  void RecoverWork() const;
  std::optional<FileLock> Lock(const std::filesystem::path& file) const;
  void ExpectFingerprint(const std::string& fingerprint) const;
};

/// The work folder of the set `target` while it is written.
std::filesystem::path WorkFolderOf(const std::filesystem::path& target);

}  // namespace dtr::io
