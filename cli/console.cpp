#include "cli/console.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/option_names.h"
#include "cli/standard_output.h"
#include "dtr/base/machine.h"
#include "dtr/base/trace.h"

namespace dtr::cli {
namespace {

volatile sig_atomic_t g_interrupted = 0;  // a signal handler can reach nothing else safely

void OnInterrupt(int signal_number) {
  g_interrupted = 1;
  signal(signal_number, SIG_DFL);  // the second one ends the program at once
}

constexpr double kWorthTellingS = 1;  // in plain lines; shorter stages would be noise

std::string Duration(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  return fmt::format("{:.0f} min {:02.0f} s", std::floor(seconds / 60), std::fmod(seconds, 60));
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// So far; COLMAP's as soon as it has ended.
std::string PeakMemory() {
  return fmt::format("at most {:.0f} MiB",
                     static_cast<double>(PeakMemoryBytesWithPrograms()) / (1 << 20));
}

// ", 12 s left": by what the share that is done took; nothing before and after that.
std::string TimeLeft(double spent_s, double share) {
  if (share <= 0 || share >= 1) return "";
  return ", " + Duration(spent_s * (1 - share) / share) + " left";
}

}  // namespace

void CatchInterrupts() {
  signal(SIGINT, OnInterrupt);
  signal(SIGTERM, OnInterrupt);
  signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is a write that fails
  // A terminal that is lost; nohup ignores it.
  if (signal(SIGHUP, OnInterrupt) == SIG_IGN) signal(SIGHUP, SIG_IGN);
}

Console::Console(bool json_on_stdout)
    : json_on_stdout_(json_on_stdout), terminal_(isatty(STDERR_FILENO) != 0) {}

Console::Console(Progress& caller) : caller_(&caller) {}

Console::~Console() {
  const std::lock_guard lock(mutex_);
  ClearBar();
}

void Console::Stage(const std::string& name, int total) {
  trace::Stage(name);
  if (caller_ != nullptr) return caller_->Stage(name, total);
  const std::lock_guard lock(mutex_);
  FinishStage();
  stage_ = name;
  total_ = total;
  done_ = told_tenths_ = 0;
  stage_start_ = std::chrono::steady_clock::now();
  if (terminal_) {
    DrawBar();
  } else if (!name.empty()) {
    WriteErr(fmt::format("== {}\n", name));
  }
}

void Console::Update(int done) {
  if (caller_ != nullptr) return caller_->Update(done);
  const std::lock_guard lock(mutex_);
  done_ = done;
  if (terminal_) {
    DrawBar();
  } else if (total_ > 0 && 10 * done / total_ > told_tenths_) {
    told_tenths_ = 10 * done / total_;
    WriteErr(fmt::format("   {} {}/{}{}\n", stage_, done, total_,
                         TimeLeft(SecondsSince(stage_start_), static_cast<double>(done) / total_)));
  }
}

void Console::Note(const std::string& line) {
  if (caller_ != nullptr) return caller_->Note(line);
  const std::lock_guard lock(mutex_);
  ClearBar();
  WriteErr(fmt::format("   {}\n", ShownText(line)));
}

void Console::Say(const std::string& line) {
  if (caller_ != nullptr) return caller_->Note(line);
  const std::lock_guard lock(mutex_);
  ClearBar();
  const std::string text = ShownText(line);
  if (json_on_stdout_) {
    WriteErr(fmt::format("{}\n", text));
  } else {
    WriteOut(text + "\n");
  }
}

bool Console::StopRequested() const {
  return caller_ != nullptr ? caller_->StopRequested() : g_interrupted != 0;
}

std::string Console::InterruptedLine() const {
  if (caller_ != nullptr) return caller_->InterruptedLine();
  return keeps_work_ ? "interrupted; what was finished is saved, the same command continues"
                     : "interrupted; the same command starts from the beginning";
}

void Console::FinishStage() {
  if (stage_.empty()) return;
  const double spent_s = SecondsSince(stage_start_);
  if (terminal_) {
    ClearBar();
    WriteErr(fmt::format("   {} ({}, {})\n", stage_, Duration(spent_s), PeakMemory()));
  } else if (spent_s >= kWorthTellingS) {
    WriteErr(fmt::format("   {}: {}, {}\n", stage_, Duration(spent_s), PeakMemory()));
  }
}

void Console::DrawBar() {
  if (stage_.empty()) return;
  constexpr int kBarWidth = 24;
  const double spent_s = SecondsSince(stage_start_);
  std::string tail = Duration(spent_s);
  int filled = 0;
  if (total_ > 0) {
    const double share = std::clamp(static_cast<double>(done_) / total_, 0.0, 1.0);
    filled = static_cast<int>(kBarWidth * share);
    tail = fmt::format("{:3.0f} %", 100 * share) + TimeLeft(spent_s, share);
  }
  tail += ", " + PeakMemory();
  WriteErr(fmt::format("\r\033[K   [{}{}] {} {}", std::string(static_cast<size_t>(filled), '='),
                       std::string(static_cast<size_t>(kBarWidth - filled), ' '), stage_, tail));
}

void Console::ClearBar() {
  if (terminal_) {
    WriteErr("\r\033[K");
  }
}

}  // namespace dtr::cli
