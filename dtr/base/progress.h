// dtr/base/progress.h -- how long work tells what it is doing, and is told to stop.
#pragma once
#include <string>

#include "dtr/base/error.h"

namespace dtr {

/// Receiver of progress. Implementations must be callable from any thread.
class Progress {
 public:
  virtual ~Progress() = default;
  /// A new stage begins, of `total` equal items (0: unknown).
  virtual void Stage(const std::string& name, int total) = 0;
  /// `done` items of the current stage are finished.
  virtual void Update(int done) = 0;
  /// One line worth telling (an omission, a warning); does not change the stage.
  virtual void Note(const std::string& line) = 0;
  /// True once the user asked to stop (Ctrl-C).
  virtual bool StopRequested() const { return false; }
  /// The one line that then ends the work: what becomes of what was done.
  virtual std::string InterruptedLine() const { return "interrupted"; }
  /// Throws Interrupted when the user asked to stop; long loops call it between items.
  void ThrowIfInterrupted() const {
    if (StopRequested()) throw Interrupted(InterruptedLine());
  }
};

/// Says nothing; the default where nobody listens.
class SilentProgress final : public Progress {
 public:
  void Stage(const std::string&, int) override {}
  void Update(int) override {}
  void Note(const std::string&) override {}
};

}  // namespace dtr
