// pipeline/batch/detail/batch_files.h -- SET.batch: what a batch consists of and what its jobs say.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/batch/batch.h"
#include "pipeline/build/build_part.h"

namespace dtr::pipeline {

/// A stage with its parts, or the end of the build.
struct BatchStage {
  std::string name;
  int parts = 1;
  bool is_last = false;  ///< `dtr build` without `stage`
};
inline constexpr char kLastStage[] = "finishing";

/// In SET.batch.
inline constexpr char kBatchFile[] = "batch.json";

/// Jobs of Slurm: an array of parts of a stage.
struct BatchJobs {
  std::string id, stage;
  int offset = 0;          ///< number of a part (from 1) less its index in the array
  std::vector<int> parts;  ///< from 0
};

/// What batch.json holds.
struct Batch {
  std::filesystem::path set;        ///< absolute
  std::filesystem::path program;    ///< dtr, as it ran last; no record decides which is run
  std::filesystem::path directory;  ///< absolute; relative paths among the words begin here
  std::vector<std::string> words;   ///< of `dtr build`
  std::vector<BatchStage> stages;   ///< each needs all before it
  int local = 0;                    ///< processes; 0: Slurm
  int threads = 0;
  SlurmOptions slurm;
  double memory_gb = 0;  ///< of a process
  /// When the set was written that `force` replaces, in ticks of the file system's clock; 0: there
  /// was none. Another one is this batch's.
  std::int64_t replaced = 0;
  std::vector<BatchJobs> jobs;
};

/// SET.batch of a set.
std::filesystem::path BatchFolder(const std::filesystem::path& set);
/// Where the output of a part goes that runs here. `part` from 0.
std::filesystem::path LogOf(const Batch& batch, const BatchStage& stage, int part);

/// Writes batch.json into the folder, which LockBatch made. Throws Error.
void WriteBatch(const Batch& batch);
/// Throws Error where there is none, or it is damaged or of another set.
Batch LoadBatch(const std::filesystem::path& set);
bool HasBatch(const std::filesystem::path& set);

/// When the set was written; 0 where there is none.
std::int64_t WhenWritten(const std::filesystem::path& set);

/// The parts of a stage that are not done, from 0.
std::vector<int> MissingParts(const Batch& batch, const BatchStage& stage);

/// Words of the process that does it; `part` from 0. Of a stage in parts they end with --part K/N.
std::vector<std::string> CommandOf(const Batch& batch, const BatchStage& stage, int part);

/// What a process said last in its log, and where that is: "it said: [...]; see [log]".
std::string LastWords(const std::filesystem::path& log);

}  // namespace dtr::pipeline
