// pipeline/export/detail/file_in_work.h -- exports that are a single file.
#pragma once
#include <filesystem>

#include "dtr/base/work_folder.h"

namespace dtr::pipeline {

/// An export that is a single file: it is made in a work folder beside it and appears when it is
/// whole. Throws as WorkFolder.
class FileInWork {
 public:
  explicit FileInWork(const std::filesystem::path& target);
  /// Where to write it.
  std::filesystem::path path() const { return work_.path() / target_.filename(); }
  /// Puts it on the disk under its name.
  void Publish();

 private:
  std::filesystem::path target_;
  WorkFolder work_;
};

}  // namespace dtr::pipeline
