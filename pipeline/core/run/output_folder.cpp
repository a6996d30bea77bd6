#include "pipeline/core/run/output_folder.h"

#include <utility>

#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/work_folder.h"

namespace dtr::pipeline {
namespace fs = std::filesystem;

void RequireFree(const fs::path& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (!fs::exists(fs::symlink_status(folder / name))) continue;
    throw UsageError((folder / name).string() +
                     ": exists already; choose another folder or give `force` to replace it");
  }
}

void RequireNew(const fs::path& output, const std::string& kind, bool force) {
  if (!WorkFolder::IsTaken(output, kind) || (force && fs::is_regular_file(output))) return;
  WorkFolder::ClearLeft(WorkFolder::Of(output), kind);
  throw UsageError(output.string() + ": exists already; choose another name");
}

OutputFolder::OutputFolder(fs::path folder, const std::string& kind,
                           const std::vector<std::string>& names, bool force)
    : folder_(std::move(folder)), mark_(folder_ / WorkFolder::MarkOf(kind)) {
  if (!force && !fs::exists(mark_)) RequireFree(folder_, names);
  fs::create_directories(folder_);
  lock_ = WorkFolder::Lock(folder_, kind);
}

void OutputFolder::Finish() {
  RemoveFile(mark_);
  lock_.reset();
}

}  // namespace dtr::pipeline
