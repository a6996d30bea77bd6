#include "cli/prompt_end.h"

#include <chrono>
#include <cstdlib>

#include "cli/command.h"
#include "cli/standard_output.h"

namespace dtr::cli {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kPatience{700};     // the window shall be gone within a second
constexpr milliseconds kBetweenLooks{50};  // a signal handler can wake nobody

}  // namespace

PromptEnd::PromptEnd(const Console& console)
    : console_(console), watcher_([this](const std::stop_token& stop) { Run(stop); }) {}

void PromptEnd::Hold(bool begins) {
  {
    const std::lock_guard lock(mutex_);
    holds_ += begins ? 1 : -1;
  }
  changed_.notify_all();
}

void PromptEnd::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto asked = [this] { return console_.StopRequested(); };
  while (!stop.stop_requested() && !asked()) {
    changed_.wait_for(lock, stop, kBetweenLooks, asked);
  }
  changed_.wait_for(lock, stop, kPatience, [] { return false; });
  changed_.wait(lock, stop, [this] { return holds_ == 0; });
  if (stop.stop_requested()) return;
  WriteErr("dtr: " + console_.InterruptedLine() + "\n");
  std::_Exit(kFailed);
}

}  // namespace dtr::cli
