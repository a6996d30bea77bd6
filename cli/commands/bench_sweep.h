// cli/commands/bench_sweep.h -- `dtr bench` without a table: error against cost, stage by stage.
#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/command.h"
#include "cli/renderers.h"
#include "dtr/eval/bench_json.h"

namespace dtr::cli {

struct SweepRequest {
  std::vector<std::string> stages = {"render"};
  std::string point;             ///< "AXIS=VALUE,...", "default": this one alone; empty: a sweep
  std::filesystem::path output;  ///< folder; empty: NAME-bench beside the set
  std::filesystem::path truth;
  std::vector<int> max_sizes_px;
  std::filesystem::path photos;  ///< to calibrate again
  std::vector<int> feature_sizes_px;
  int max_points = 60;
  double max_loss_db = 0.1;
  std::optional<double> budget_ms;

  // What the tables have, too.
  std::filesystem::path set;
  eval::BenchOptions bench;
  std::string size;
  RendererChoice renderer;
};

/// Declares the options that only the sweep has, none of which goes with `table`.
void AddSweepOptions(CLI::App& command, CLI::Option* table, SweepRequest& request);

/// Sweeps, or measures one point; writes bench.json, bench.csv, bench.html and work.json.
int RunSweep(const SweepRequest& request, const Context& context);

/// What times are worth nothing without.
eval::BenchMachine MachineOf(const eval::TimedRenderer& renderer);

}  // namespace dtr::cli
