#include "pipeline/batch/batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/hand_over.h"
#include "dtr/io/set_io.h"
#include "pipeline/batch/detail/batch_files.h"
#include "pipeline/batch/detail/batch_folder.h"
#include "pipeline/batch/detail/local.h"
#include "pipeline/batch/detail/slurm.h"
#include "pipeline/core/reports/text.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// More parts than photos would only begin and end.
int PartsFor(const BatchOptions& options) {
  int photos = 0;
  if (fs::is_directory(options.build.photos)) {
    photos = capture::ContentsOf(options.build.photos, true).photos;
  }
  return photos > 0 ? std::min(options.array_size, photos) : options.array_size;
}

Batch Planned(const BatchOptions& options) {
  Batch batch;
  batch.set = WithoutTrailingSlash(fs::absolute(options.build.output).lexically_normal());
  batch.program = options.program;
  batch.directory = fs::absolute(options.directory);
  batch.words = options.words;
  const int parts = PartsFor(options);
  for (const BuildStage& stage : BuildStages(options.build)) {
    batch.stages.push_back({stage.name, stage.has_parts ? parts : 1, false});
  }
  batch.stages.push_back({kLastStage, 1, true});
  batch.local = options.local;
  batch.slurm = options.slurm;
  batch.replaced = WhenWritten(batch.set);
  batch.memory_gb = options.build.depth.memory_gb.value_or(kDefaultMemoryGb);
  return batch;
}

// A batch that was begun keeps its parts; what else is asked for may be new.
void KeepParts(const Batch& before, Batch& batch) {
  if (before.words != batch.words || before.directory != batch.directory) {
    throw UsageError(
        fmt::format("{}: expected a batch of the same words, found one of others; end it with dtr "
                    "batch resume, or delete it and {}.partial",
                    BatchFolder(batch.set).string(), batch.set.string()));
  }
  batch.stages = before.stages;
  batch.jobs = before.jobs;
  batch.replaced = before.replaced;
}

void RequireNoneUnderWay(const Batch& batch) {
  if (batch.jobs.empty()) return;
  if (const auto queued = QueuedParts(batch); !queued.empty()) {
    throw UsageError(fmt::format(
        "{}: {} of its parts are waiting or running; dtr batch status says how far they are, dtr "
        "batch cancel ends them",
        BatchFolder(batch.set).string(), queued.size()));
  }
}

StageState StateOf(const Batch& batch, const BatchStage& stage,
                   const std::vector<QueuedPart>& queued) {
  StageState state{.stage = stage.name, .parts = stage.parts};
  if (stage.is_last) {
    state.done = MissingParts(batch, stage).empty();
  } else {
    for (int part = 0; part < stage.parts; ++part) {
      const auto done = FindDonePart(batch.set, {stage.name, {part, stage.parts}});
      if (!done) continue;
      ++state.done;
      state.cpu_s += done->cpu_s;
      state.wall_s += done->wall_s;
    }
  }
  for (const QueuedPart& part : queued) {
    if (part.stage == stage.name) ++(part.is_running ? state.running : state.waiting);
  }
  return state;
}

// Where the output of a part went that Slurm ran.
fs::path SlurmLogOf(const Batch& batch, const BatchStage& stage, const BatchJobs& jobs, int part) {
  if (stage.parts == 1) return LogOf(batch, stage, part);
  return BatchFolder(batch.set) / "logs" /
         fmt::format("{}_slurm_{}_{}.log", stage.name, jobs.id, part + 1 - jobs.offset);
}

// Parts that were submitted, are not done and are in no queue. Those that waited for one of them
// were ended by Slurm, and have no log.
std::vector<std::string> FailedOf(const Batch& batch, const std::vector<QueuedPart>& queued) {
  std::vector<std::string> failed;
  for (const BatchJobs& jobs : batch.jobs) {
    const auto stage = std::find_if(batch.stages.begin(), batch.stages.end(),
                                    [&](const BatchStage& one) { return one.name == jobs.stage; });
    if (stage == batch.stages.end()) continue;
    const std::vector<int> missing = MissingParts(batch, *stage);
    for (const int part : jobs.parts) {
      const bool is_missing = std::find(missing.begin(), missing.end(), part) != missing.end();
      const bool is_queued = std::any_of(queued.begin(), queued.end(), [&](const QueuedPart& q) {
        return q.stage == stage->name && q.part == part;
      });
      const fs::path log = SlurmLogOf(batch, *stage, jobs, part);
      if (!is_missing || is_queued || !fs::exists(log)) continue;
      failed.push_back(fmt::format("{}: ended without being done; {}",
                                   NameOf(BuildPart{stage->name, {part, stage->parts}}),
                                   LastWords(log)));
    }
  }
  return failed;
}

BatchState StateOf(const Batch& batch) {
  const bool is_finished = MissingParts(batch, batch.stages.back()).empty();
  const auto queued = is_finished ? std::vector<QueuedPart>() : QueuedParts(batch);
  BatchState state;
  state.set = batch.set;
  for (const BatchStage& stage : batch.stages) {
    state.stages.push_back(StateOf(batch, stage, queued));
  }
  state.finished = state.stages.back().done > 0;
  // The work folder, which says what was done, went with the end.
  if (state.finished) {
    for (StageState& stage : state.stages) stage.done = stage.parts;
  } else {
    state.failed = FailedOf(batch, queued);
  }
  for (const BatchJobs& jobs : batch.jobs) state.jobs.push_back(jobs.id);
  return state;
}

void DryRun(Batch& batch, const std::function<void(const std::string&)>& say) {
  if (batch.local == 0) return SubmitToSlurm(batch, true, say);
  for (const BatchStage& stage : batch.stages) {
    say(fmt::format("{}: {} parts", stage.name, stage.parts));
  }
}

// A record decides nothing about what is run; another version rejects the parts of this one.
void NoteProgram(const Batch& before, const Batch& batch, Progress& progress) {
  if (before.program == batch.program) return;
  progress.Note(fmt::format("{}: names the program {}; {} goes on with it",
                            BatchFolder(batch.set).string(), before.program.string(),
                            batch.program.string()));
}

[[noreturn]] void RejectMissingSet(const Batch& batch) {
  throw Error(fmt::format(
      "{}: expected the set, as all of its parts ended well, found none; look into {}, then do "
      "dtr batch resume",
      batch.set.string(), LogOf(batch, batch.stages.back(), 0).string()));
}

}  // namespace

std::string ToJson(const BatchState& state) {
  nlohmann::ordered_json json = {{"set", state.set.string()}, {"finished", state.finished}};
  json["stages"] = nlohmann::ordered_json::array();
  for (const StageState& stage : state.stages) {
    json["stages"].push_back({{"stage", stage.stage},
                              {"parts", stage.parts},
                              {"done", stage.done},
                              {"waiting", stage.waiting},
                              {"running", stage.running},
                              {"cpu_s", stage.cpu_s},
                              {"wall_s", stage.wall_s}});
  }
  json["failed"] = state.failed;
  json["jobs"] = state.jobs;
  return Text(json);
}

BatchState RunBatch(const BatchOptions& options, const std::function<void(const std::string&)>& say,
                    Progress& progress) {
  Batch batch = Planned(options);
  if (const auto warning = RequireOwnBatch(batch.set); !warning.empty()) progress.Note(warning);
  std::optional<FileLock> lock;
  std::optional<Batch> before;
  if (HasBatch(batch.set)) {
    LoadBatch(batch.set);  // rejects a record that is none before anything is written beside it
    if (!options.dry_run) lock = LockBatch(batch.set);
    before = LoadBatch(batch.set);
  }
  const bool was_finished = before && MissingParts(*before, before->stages.back()).empty();
  if (was_finished && options.resumes) {
    if (!options.dry_run) io::Recover(batch.set);
    return StateOf(*before);
  }
  if (before && !was_finished) RequireNoneUnderWay(*before);
  if (before && !was_finished && fs::exists(io::SetWriter::WorkFolderOf(batch.set))) {
    KeepParts(*before, batch);
  } else {
    io::SetWriter::RequireTarget(options.build.output, options.build.force);
  }
  if (before) NoteProgram(*before, batch, progress);
  if (options.dry_run) {
    DryRun(batch, say);
    return {};
  }
  if (!lock) lock = LockBatch(batch.set);
  if (options.local > 0) batch.jobs.clear();
  WriteBatch(batch);
  if (options.local == 0) {
    SubmitToSlurm(batch, false, say);
    return StateOf(batch);
  }
  RunLocally(batch, progress);
  const BatchState state = StateOf(batch);
  if (!state.finished) RejectMissingSet(batch);
  return state;
}

BatchOptions ReadBatch(const fs::path& set) {
  RequireOwnBatch(set);
  const Batch batch = LoadBatch(set);
  BatchOptions options;
  options.words = batch.words;
  options.directory = batch.directory;
  options.local = batch.local;
  options.slurm = batch.slurm;
  options.resumes = true;
  return options;
}

BatchState StateOfBatch(const fs::path& set) { return StateOf(LoadBatch(set)); }

int CancelBatch(const fs::path& set) {
  const Batch batch = LoadBatch(set);
  const auto queued = QueuedParts(batch);
  CancelJobs(queued);
  return static_cast<int>(queued.size());
}

}  // namespace dtr::pipeline
