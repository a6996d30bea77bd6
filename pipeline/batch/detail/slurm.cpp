#include "pipeline/batch/detail/slurm.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/process.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// Lines that a program of Slurm writes. Throws Error where it fails.
std::vector<std::string> Ask(const std::vector<std::string>& argv) {
  if (FindProgram(argv.front()).empty()) {
    throw Error(argv.front() +
                ": expected Slurm's program on the PATH, found none; install slurm-client, or give "
                "`local`");
  }
  std::vector<std::string> lines;
  ProcessOptions options;
  options.on_line = [&](const std::string& line) { lines.push_back(line); };
  const ProcessResult result = RunProcess(argv, options);
  if (result.Ok()) return lines;
  throw Error(fmt::format("{}: Slurm rejects it: {}", argv.front(),
                          lines.empty() ? "without a word" : lines.back()));
}

// The largest index of an array is below it.
int MaxArraySize() {
  constexpr int kSlurmsDefault = 1001;
  int size = 0;
  for (const std::string& line : Ask({"scontrol", "show", "config"})) {
    if (std::sscanf(line.c_str(), " MaxArraySize = %d", &size) == 1 && size > 1) return size;
  }
  return kSlurmsDefault;
}

// For the shell: one word, whatever is in it.
std::string Quoted(const std::string& word) {
  std::string quoted = "'";
  for (const char c : word) {
    if (c == '\'') {
      quoted += "'\\''";
    } else {
      quoted += c;
    }
  }
  return quoted + "'";
}

// In Slurm's names of files a per cent sign begins a pattern.
std::string WithoutPatterns(const std::string& path) {
  std::string plain;
  for (const char c : path) plain += c == '%' ? "%%" : std::string(1, c);
  return plain;
}

// "1-5,8": numbers in rising order.
std::string RangesOf(const std::vector<int>& numbers) {
  std::vector<std::string> ranges;
  for (size_t begin = 0, end = 0; begin < numbers.size(); begin = end) {
    for (end = begin + 1; end < numbers.size() && numbers[end] == numbers[end - 1] + 1;) ++end;
    ranges.push_back(end - begin == 1 ? fmt::format("{}", numbers[begin])
                                      : fmt::format("{}-{}", numbers[begin], numbers[end - 1]));
  }
  return fmt::format("{}", fmt::join(ranges, ","));
}

// What the job of a stage runs. Slurm gives the number of its part.
std::string ScriptOf(const Batch& batch, const BatchStage& stage, int offset) {
  std::vector<std::string> words = CommandOf(batch, stage, 0);
  const bool is_array = stage.parts > 1;
  if (is_array) words.resize(words.size() - 2);  // --part K/N
  std::string command;
  for (const std::string& word : words) command += Quoted(word) + " ";
  if (is_array) {
    command += fmt::format("--part \"$((SLURM_ARRAY_TASK_ID + {}))/{}\" ", offset, stage.parts);
  }
  return fmt::format("#!/bin/sh\nexec {}--threads \"${{SLURM_CPUS_PER_TASK:-1}}\"\n", command);
}

// What a process takes beside what `memory` counts, and what Slurm is asked for.
int MebibytesOf(double memory_gb) {
  constexpr double kMore = 1.25, kProgramMebibytes = 512, kMebibyte = 1 << 20;
  return static_cast<int>(
      std::ceil(kMore * memory_gb * kBytesPerGigabyte / kMebibyte + kProgramMebibytes));
}

std::vector<std::string> SbatchOf(const Batch& batch, const BatchStage& stage,
                                  const std::vector<int>& indices,
                                  const std::vector<std::string>& before, const fs::path& script) {
  const fs::path logs = BatchFolder(batch.set) / "logs";
  const std::string log =
      stage.parts > 1 ? fmt::format("{}_slurm_%A_%a.log", stage.name) : stage.name + "_1.log";
  std::vector<std::string> argv = {"sbatch",
                                   "--parsable",
                                   "--job-name=dtr-" + stage.name,
                                   "--chdir=" + batch.directory.string(),
                                   "--output=" + WithoutPatterns(logs.string()) + "/" + log,
                                   "--kill-on-invalid-dep=yes",
                                   fmt::format("--mem={}M", MebibytesOf(batch.memory_gb))};
  if (stage.parts > 1) argv.push_back("--array=" + RangesOf(indices));
  if (!before.empty())
    argv.push_back(fmt::format("--dependency=afterok:{}", fmt::join(before, ":")));
  const SlurmOptions& slurm = batch.slurm;
  if (!slurm.partition.empty()) argv.push_back("--partition=" + slurm.partition);
  if (!slurm.account.empty()) argv.push_back("--account=" + slurm.account);
  if (!slurm.time.empty()) argv.push_back("--time=" + slurm.time);
  if (slurm.cpus_per_task > 0) {
    argv.push_back(fmt::format("--cpus-per-task={}", slurm.cpus_per_task));
  }
  argv.push_back(script.string());
  return argv;
}

// "ID" or "ID;CLUSTER".
std::string JobIdIn(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    const std::string id = line.substr(0, line.find(';'));
    if (!id.empty() &&
        std::all_of(id.begin(), id.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) {
      return id;
    }
  }
  throw Error(
      fmt::format("sbatch: expected the number of a job, found '{}'", fmt::join(lines, " ")));
}

}  // namespace

void SubmitToSlurm(Batch& batch, bool dry_run, const std::function<void(const std::string&)>& say) {
  const int chunk = MaxArraySize() - 1;
  std::vector<std::string> before;
  batch.jobs.clear();
  for (const BatchStage& stage : batch.stages) {
    const std::vector<int> missing = MissingParts(batch, stage);
    std::vector<std::string> ids;
    for (size_t begin = 0, end = 0; begin < missing.size(); begin = end) {
      const int offset = missing[begin] / chunk * chunk;
      std::vector<int> indices, parts;
      for (end = begin; end < missing.size() && missing[end] < offset + chunk; ++end) {
        parts.push_back(missing[end]);
        indices.push_back(missing[end] + 1 - offset);
      }
      const fs::path script =
          BatchFolder(batch.set) / fmt::format("{}_{}.sh", stage.name, offset / chunk);
      const std::string text = ScriptOf(batch, stage, offset);
      const std::vector<std::string> argv = SbatchOf(batch, stage, indices, before, script);
      if (dry_run) {
        std::vector<std::string> words;
        for (const std::string& word : argv) words.push_back(Quoted(word));
        say(fmt::format("{}\n{}", fmt::join(words, " "), text));
        ids.push_back("ID-of-" + script.stem().string());
        continue;
      }
      WriteFileAtomically(script, text);
      ids.push_back(JobIdIn(Ask(argv)));
      batch.jobs.push_back({ids.back(), stage.name, offset, parts});
      WriteBatch(batch);
      say(fmt::format("{}: {} of {} parts, job {}", stage.name, parts.size(), stage.parts,
                      ids.back()));
    }
    if (!ids.empty()) before = ids;
  }
}

std::vector<QueuedPart> QueuedParts(const Batch& batch) {
  std::vector<QueuedPart> queued;
  if (batch.jobs.empty()) return queued;
  std::map<std::string, const BatchJobs*> jobs;
  for (const BatchJobs& one : batch.jobs) jobs[one.id] = &one;
  const std::string folder = BatchFolder(batch.set).string() + "/";
  for (const std::string& line : Ask({"squeue", "--noheader", "--array", "--format=%F %K %T %o"})) {
    char id[32] = "", index[32] = "", state[32] = "";
    int used = 0;
    if (std::sscanf(line.c_str(), " %31s %31s %31s %n", id, index, state, &used) != 3) continue;
    const auto found = jobs.find(id);
    const bool is_ours = line.substr(static_cast<size_t>(used)).starts_with(folder);
    if (found == jobs.end() || !is_ours) continue;
    int number = 0;
    const bool is_array = std::sscanf(index, "%d", &number) == 1;
    queued.push_back({id, found->second->stage, is_array ? number - 1 + found->second->offset : 0,
                      std::string(state) != "PENDING"});
  }
  return queued;
}

void CancelJobs(const std::vector<QueuedPart>& parts) {
  std::set<std::string> ids;
  for (const QueuedPart& part : parts) ids.insert(part.id);
  std::vector<std::string> argv = {"scancel"};
  argv.insert(argv.end(), ids.begin(), ids.end());
  if (!ids.empty()) Ask(argv);
}

}  // namespace dtr::pipeline
