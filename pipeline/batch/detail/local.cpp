#include "pipeline/batch/detail/local.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/process.h"

namespace dtr::pipeline {
namespace {

// What went wrong with the first part that did.
class FirstFailure {
 public:
  bool Happened() const { return happened_; }
  void Set(int part, std::string what) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (happened_ && part_ <= part) return;
    part_ = part;
    what_ = std::move(what);
    happened_ = true;
  }
  const std::string& what() const { return what_; }

 private:
  std::atomic<bool> happened_ = false;
  std::mutex mutex_;
  int part_ = 0;
  std::string what_;
};

std::string HowItEnded(const ProcessResult& result) {
  if (result.signal != 0) return fmt::format("ended by signal {}", result.signal);
  return fmt::format("ended with code {}", result.exit_code);
}

void RunPartHere(const Batch& batch, const BatchStage& stage, int part, int threads,
                 const Progress& progress, FirstFailure& failure) {
  std::vector<std::string> words = CommandOf(batch, stage, part);
  words.insert(words.end(), {"--threads", std::to_string(threads)});
  ProcessOptions options;
  options.log_file = LogOf(batch, stage, part);
  options.working_directory = batch.directory;
  options.should_stop = [&] { return progress.StopRequested(); };
  const ProcessResult result = RunProcess(words, options);
  if (result.Ok()) return;
  failure.Set(part, fmt::format("{}: {}; {}", NameOf(BuildPart{stage.name, {part, stage.parts}}),
                                HowItEnded(result), LastWords(options.log_file)));
}

}  // namespace

void RunLocally(const Batch& batch, Progress& progress) {
  const int cores = batch.threads > 0 ? batch.threads : ThreadLimit::Current();
  for (const BatchStage& stage : batch.stages) {
    const std::vector<int> missing = MissingParts(batch, stage);
    if (missing.empty()) continue;
    const int at_once = std::min(batch.local, static_cast<int>(missing.size()));
    progress.Stage(stage.name, static_cast<int>(missing.size()));
    std::atomic<int> done = 0;
    FirstFailure failure;
    ParallelFor(0, static_cast<int>(missing.size()), at_once, [&](int i) {
      progress.ThrowIfInterrupted();
      if (failure.Happened()) return;
      RunPartHere(batch, stage, missing[static_cast<size_t>(i)], std::max(1, cores / at_once),
                  progress, failure);
      progress.Update(++done);
    });
    progress.ThrowIfInterrupted();
    if (failure.Happened()) throw Error(failure.what());
  }
}

}  // namespace dtr::pipeline
