// dtr/base/quiet_progress.h -- a part of a longer work, which says no more than that it is done.
#pragma once
#include <string>

#include "dtr/base/progress.h"

namespace dtr {

/// Passes on that the user wants to stop, and no stage, share or note: those of one photo or time
/// step of many would come as often as there are of them.
class QuietProgress final : public Progress {
 public:
  explicit QuietProgress(const Progress& whole) : whole_(whole) {}
  void Stage(const std::string&, int) override {}
  void Update(int) override {}
  void Note(const std::string&) override {}
  bool StopRequested() const override { return whole_.StopRequested(); }
  std::string InterruptedLine() const override { return whole_.InterruptedLine(); }

 private:
  const Progress& whole_;
};

}  // namespace dtr
