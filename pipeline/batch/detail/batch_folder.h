// pipeline/batch/detail/batch_folder.h -- whose SET.batch is: what lies in it decides what a batch
// does, so that it must be the work of the user who goes on with it.
#pragma once
#include <filesystem>
#include <string>

#include "dtr/base/durable.h"

namespace dtr::pipeline {

/// Throws UsageError unless there is nothing, an empty folder or what `dtr batch` made for this
/// user and not every user may write in. Returns a warning where its group may; else nothing.
std::string RequireOwnBatch(const std::filesystem::path& set);

/// Makes SET.batch where there is none, for its owner alone to write in, and keeps other batches of
/// the set away for the life of the lock. Throws UsageError where one is at work, Error.
FileLock LockBatch(const std::filesystem::path& set);

}  // namespace dtr::pipeline
