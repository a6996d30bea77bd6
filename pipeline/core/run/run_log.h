// pipeline/core/run/run_log.h -- what each stage cost; kept in report/run.json, outside every
// hash.
#pragma once
#include <chrono>
#include <string>
#include <vector>

#include "dtr/io/set_io.h"

namespace dtr::pipeline {

/// Measures stages one after another.
class RunLog {
 public:
  /// Ends the running stage and begins another.
  void Begin(const std::string& name);
  /// Ends the running stage.
  void End();
  /// Adds to the running stage what an interrupted run before spent on it.
  void AddEarlier(double wall_s, double cpu_s);
  const std::vector<io::RunStage>& stages() const { return stages_; }
  /// The record of the run (its command line is this program's), with these lines, to be written
  /// by io::WriteRunRecord.
  io::RunRecord Record(std::vector<std::string> lines = {}) const;

 private:
  std::vector<io::RunStage> stages_;
  bool running_ = false;
  double cpu_start_s_ = 0, earlier_wall_s_ = 0, earlier_cpu_s_ = 0;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace dtr::pipeline
