// pipeline/batch/detail/local.h -- the parts of a batch as processes of this machine.
#pragma once
#include "dtr/base/progress.h"
#include "pipeline/batch/detail/batch_files.h"

namespace dtr::pipeline {

/// Runs what is missing, stage by stage, `batch.local` processes at a time. Throws Error naming the
/// first part that failed, when the others have ended; Interrupted.
void RunLocally(const Batch& batch, Progress& progress);

}  // namespace dtr::pipeline
