// pipeline/build/detail/stages.h -- the stages of a build as a list: what runs them, repeats one or
// shares their work walks it.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "dtr/base/machine.h"
#include "pipeline/build/build_part.h"
#include "pipeline/build/detail/part_files.h"
#include "pipeline/core/run/run_log.h"

namespace dtr::pipeline {

/// A step of a stage that a process of its own can do; what is before it comes from the disk.
struct Step : BuildStage {
  std::function<void(const Part&)> run;
  bool is_counted = true;  ///< by the records of its parts; else its checkpoints have its cost
};

struct Stage {
  std::string name;                      ///< of --force-stage and in the record of the run
  std::function<void()> run;             ///< all of it that is not done; those before it are
  std::vector<std::string> leaves = {};  ///< below the partial set, for a later run
  std::function<std::vector<Step>()> steps = {};  ///< none: it is not shared
};

/// Runs all of them in their order. What a stage cost goes to the log, with what other processes
/// did of it; `work`: the work folder of the set.
inline void RunStages(const std::vector<Stage>& stages, const std::filesystem::path& work,
                      RunLog& log) {
  for (const Stage& stage : stages) {
    ReturnFreedMemory();  // so that the limit holds of what is in use
    log.Begin(stage.name);
    stage.run();
    if (!stage.steps || !HasParts(work)) continue;
    for (const Step& step : stage.steps()) {
      const DonePart total = step.is_counted ? TotalOf(work, step.name) : DonePart{};
      log.AddEarlier(total.wall_s, total.cpu_s);
    }
  }
}

}  // namespace dtr::pipeline
