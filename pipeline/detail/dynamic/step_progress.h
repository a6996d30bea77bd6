// pipeline/detail/dynamic/step_progress.h -- work on one time step of many, which tells no more of
// itself than that it is done.
#pragma once
#include <string>

#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// Passes on that the user wants to stop, and no stage, share or note: what holds of one time step
/// would stand there as often as there are time steps.
class StepProgress final : public Progress {
 public:
  explicit StepProgress(const Progress& whole) : whole_(whole) {}
  void Stage(const std::string&, int) override {}
  void Update(int) override {}
  void Note(const std::string&) override {}
  bool StopRequested() const override { return whole_.StopRequested(); }
  std::string InterruptedLine() const override { return whole_.InterruptedLine(); }

 private:
  const Progress& whole_;
};

}  // namespace dtr::pipeline
