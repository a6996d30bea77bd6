// pipeline/core/run/output_folder.h -- files written one by one into a folder of the user's.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/durable.h"

namespace dtr::pipeline {

/// Throws UsageError naming the first of `names` that is in `folder` already.
void RequireFree(const std::filesystem::path& folder, const std::vector<std::string>& names);

/// Throws UsageError where `output` is there, unless it is a file and `force`, or the work of a
/// killed process that this one finishes (WorkFolder::IsTaken). What such a process left beside it
/// is cleared away.
void RequireNew(const std::filesystem::path& output, const std::string& kind, bool force);

/// A folder into which a job writes files, while a file KIND.lock in it says so: after a job that
/// was cut off the same command replaces what it left.
class OutputFolder {
 public:
  /// Makes the folder. Throws UsageError where one of `names` is there already, unless `force` or
  /// an unfinished job left them, and while another process writes into it; Error where it cannot
  /// be made.
  OutputFolder(std::filesystem::path folder, const std::string& kind,
               const std::vector<std::string>& names, bool force);
  const std::filesystem::path& path() const { return folder_; }
  /// Takes the mark away.
  void Finish();

 private:
  std::filesystem::path folder_, mark_;
  std::optional<FileLock> lock_;
};

}  // namespace dtr::pipeline
