// cli/console.h -- talks to the person at the terminal.
#pragma once
#include <chrono>
#include <mutex>
#include <string>

#include "dtr/base/progress.h"

namespace dtr::cli {

/// Progress and messages. A bar on a terminal, plain lines elsewhere (at most one per stage and
/// tenth). Everything goes to stderr, except Say() while stdout is not taken by JSON.
class Console final : public Progress {
 public:
  explicit Console(bool json_on_stdout);
  /// For a command that another program calls (run_command.h): `caller` receives all of it, Say()
  /// as notes, and decides when to stop; nothing is printed. It must outlive the console.
  explicit Console(Progress& caller);
  ~Console() override;

  void Stage(const std::string& name, int total) override;
  void Update(int done) override;
  void Note(const std::string& line) override;
  bool StopRequested() const override;  ///< after Ctrl-C, SIGTERM or SIGHUP
  std::string InterruptedLine() const override;

  /// Said by commands that go on where an interrupted run of theirs ended.
  void KeepsWork() { keeps_work_ = true; }

  /// A result for people.
  void Say(const std::string& line);

 private:
  void FinishStage();  // requires mutex_
  void DrawBar();      // requires mutex_
  void ClearBar();     // requires mutex_

  Progress* const caller_ = nullptr;
  std::mutex mutex_;
  bool json_on_stdout_ = false;
  bool terminal_ = false;
  bool keeps_work_ = false;
  std::string stage_;
  int total_ = 0, done_ = 0, told_tenths_ = 0;
  std::chrono::steady_clock::time_point stage_start_;
};

/// Installs handlers for SIGINT, SIGTERM and SIGHUP that only set a flag; the second one kills.
/// SIGHUP stays ignored where it is (nohup).
void CatchInterrupts();

}  // namespace dtr::cli
