// pipeline/core/run/recorded_notes.h -- what was told on the way, kept for the record of the run.
#pragma once
#include <mutex>
#include <string>
#include <vector>

#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// Passes everything on and remembers the notes: what was left out, and why, and warnings.
class RecordedNotes final : public Progress {
 public:
  explicit RecordedNotes(Progress& listener) : listener_(listener) {}
  void Stage(const std::string& name, int total) override { listener_.Stage(name, total); }
  void Update(int done) override { listener_.Update(done); }
  void Note(const std::string& line) override;
  bool StopRequested() const override { return listener_.StopRequested(); }
  std::string InterruptedLine() const override { return listener_.InterruptedLine(); }

  /// The notes so far, in their order.
  std::vector<std::string> lines() const;

 private:
  Progress& listener_;
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
};

}  // namespace dtr::pipeline
