// cli/prompt_end.h -- a window that a signal closes is gone soon, whatever it waits for.
#pragma once
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

#include "cli/console.h"

namespace dtr::cli {

/// While it lives: ends the program, with the line and exit code of an interrupted command, where
/// it does not end by itself within kPatience of the first signal. What it may wait for (a photo
/// that is being read, an image that is being drawn) is of no use any more.
class PromptEnd {
 public:
  explicit PromptEnd(const Console& console);
  PromptEnd(const PromptEnd&) = delete;
  PromptEnd& operator=(const PromptEnd&) = delete;

  /// True and false in pairs: between them the program is not ended, as a file may be half-written.
  /// Callable from any thread.
  void Hold(bool begins);

 private:
  void Run(const std::stop_token& stop);

  const Console& console_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  int holds_ = 0;
  std::jthread watcher_;  // last: it stops before the rest goes
};

}  // namespace dtr::cli
