// cli/sweep_facts.h -- bench.json read back: what the console, the page and `dtr inspect` tell of a
// sweep.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dtr/eval/bench_json.h"
#include "dtr/eval/sweep.h"
#include "dtr/eval/timed_renderer.h"

namespace dtr::cli {

/// A setting that was measured. The range of its cost is widened already (eval::RangeOf).
struct PointFacts {
  std::string setting, command;
  std::string group;  ///< value of the stage's first axis: the method, the engine
  double cost = 0, cost_least = 0, cost_most = 0, error = 0;
  std::optional<double> psnr_db;
  bool on_front = false;
  std::optional<double> build_cpu_s;  ///< of the whole build, where the set records it
  double not_registered = 0;          ///< photos that the calibration found no camera for
};

struct StageFacts {
  std::string name, cost_name, error_name, conditions;
  std::vector<PointFacts> points;  ///< at least one
  std::vector<size_t> front;       ///< indices into points, as those below
  std::optional<size_t> knee, cheapest, within_budget;
  double max_loss_db = 0;
  std::optional<double> budget;
  std::optional<eval::DefaultAssessment> usual;
  std::optional<eval::Times> machine;  ///< of the calibration loop; least, median and most
};

struct SweepFacts {
  std::string set;
  eval::BenchMachine machine;
  std::vector<StageFacts> stages;
};

/// `json`: what SweepJson gives. Throws Error, which begins with `file` and names the field, where
/// it is something else.
SweepFacts FactsOf(const nlohmann::ordered_json& json, const std::string& file);
/// The same of the text of a file.
SweepFacts ReadSweep(const std::string& text, const std::string& file);

/// "2 photos without a camera" of a calibration that has such; empty otherwise.
std::string WithoutCamera(const PointFacts& point);

/// One line: is the default on the front, and if not what beats it?
std::string DefaultSentence(const StageFacts& stage);

}  // namespace dtr::cli
