// pipeline/batch/batch.h -- a build as jobs: of several processes here, or of a cluster that runs
// Slurm.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "pipeline/build/build.h"

namespace dtr::pipeline {

/// What Slurm is asked for; empty or 0: nothing, its own defaults hold.
struct SlurmOptions {
  std::string partition, account;
  std::string time;       ///< limit of every job, as sbatch takes it: "2:00:00"
  int cpus_per_task = 0;  ///< of every process
};

struct BatchOptions {
  /// The build: what its stages are. All else comes from `words`.
  BuildOptions build;
  std::filesystem::path program;    ///< dtr, as the jobs call it; never that of a record
  std::vector<std::string> words;   ///< of `dtr build`: photos and options
  std::filesystem::path directory;  ///< that relative paths among them begin in
  int array_size = 16;              ///< parts of a stage, at most
  int local = 0;                    ///< so many processes here; 0: Slurm
  SlurmOptions slurm;
  int threads = 0;       ///< of all local processes together; 0: all cores
  bool resumes = false;  ///< of a batch that is finished nothing is begun again
  bool dry_run = false;  ///< says what would be done, and touches nothing
};

/// How far a stage is.
struct StageState {
  std::string stage;  ///< "finishing" is the end of the build
  int parts = 1, done = 0;
  int waiting = 0, running = 0;  ///< of the others, as Slurm says
  double cpu_s = 0, wall_s = 0;  ///< of the parts that are done
};

/// How far a build is.
struct BatchState {
  std::filesystem::path set;
  bool finished = false;  ///< the set is there
  std::vector<StageState> stages;
  std::vector<std::string> failed;  ///< a line for each part that ended without being done
  std::vector<std::string> jobs;    ///< ids of Slurm
};

/// JSON object by the field names.
std::string ToJson(const BatchState& state);

/// Runs the build here, or submits its jobs and returns. What is done already is not done again.
/// Beside the set lies SET.batch, a folder with the jobs and what they say. `say` receives the
/// lines of a dry run and of what was submitted. Throws UsageError where another batch of other
/// words is under way or jobs of this one still are, or where SET.batch is not this user's; Error
/// where a part fails (naming it, its last line and its log), the set is not there at the end, or
/// Slurm rejects.
BatchState RunBatch(const BatchOptions& options, const std::function<void(const std::string&)>& say,
                    Progress& progress);

/// The batch that SET.batch describes, to be run again by RunBatch: what is missing. `program` is
/// left to the caller. Throws Error where there is none, UsageError where it is not this user's.
BatchOptions ReadBatch(const std::filesystem::path& set);

/// How far it is. Throws Error where there is none.
BatchState StateOfBatch(const std::filesystem::path& set);

/// Ends its jobs that Slurm still has; what was done stays. Returns how many there were.
int CancelBatch(const std::filesystem::path& set);

}  // namespace dtr::pipeline
