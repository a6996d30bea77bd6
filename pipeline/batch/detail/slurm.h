// pipeline/batch/detail/slurm.h -- the parts of a batch as jobs of Slurm; all that knows its
// programs (sbatch, squeue, scancel, scontrol; 22.05 and later).
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "pipeline/batch/detail/batch_files.h"

namespace dtr::pipeline {

/// Writes a script for each stage with missing parts into SET.batch and submits it: an array that
/// waits for the whole of the stage before (afterok), in several where the cluster's MaxArraySize
/// asks for it. Records the jobs in `batch`. `say` receives a line per submission; in a dry run
/// nothing is written or submitted, and it receives commands and scripts. Throws Error where
/// Slurm is missing or rejects a job; those submitted before stay.
void SubmitToSlurm(Batch& batch, bool dry_run, const std::function<void(const std::string&)>& say);

/// A part that Slurm has in its queue.
struct QueuedPart {
  std::string id, stage;
  int part = 0;
  bool is_running = false;
};
/// Of the batch, known by their scripts: numbers may be of other jobs, too. Throws Error where
/// Slurm does not answer.
std::vector<QueuedPart> QueuedParts(const Batch& batch);

/// Ends the jobs of these. Throws Error where Slurm rejects.
void CancelJobs(const std::vector<QueuedPart>& parts);

}  // namespace dtr::pipeline
