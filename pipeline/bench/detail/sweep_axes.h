// pipeline/bench/detail/sweep_axes.h -- what the stages to sweep share.
#pragma once
#include <string>
#include <vector>

#include "dtr/base/progress.h"

namespace dtr::pipeline {

constexpr double kMillisecondsPerSecond = 1000;

/// Stages of what is measured would hide the sweep's own; notes are worth reading.
class NotesOnly final : public Progress {
 public:
  explicit NotesOnly(Progress& progress) : progress_(progress) {}
  void Stage(const std::string&, int) override {}
  void Update(int) override {}
  void Note(const std::string& line) override { progress_.Note(line); }
  bool StopRequested() const override { return progress_.StopRequested(); }
  std::string InterruptedLine() const override { return progress_.InterruptedLine(); }

 private:
  Progress& progress_;
};

/// Long sides to try, as values of an axis: those given, where 0 and what is larger mean `own_px`;
/// without any `own_px`, seven tenths and half of it. Each once.
std::vector<std::string> SizeValues(const std::vector<int>& given_px, int own_px);

}  // namespace dtr::pipeline
