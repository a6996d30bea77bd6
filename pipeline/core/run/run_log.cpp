#include "pipeline/core/run/run_log.h"

#include <sys/resource.h>

#include <utility>

#include "dtr/base/machine.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/process.h"
#include "dtr/base/utf8.h"

namespace dtr::pipeline {
namespace {

double CpuSeconds() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) {
      seconds += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    }
  }
  return seconds;
}

// As JSON can hold it: names of files may be any bytes.
std::vector<std::string> CommandLineInUtf8() {
  std::vector<std::string> words = CommandLine();
  for (std::string& word : words) {
    if (IsUtf8(word)) continue;
    for (char& c : word) {
      if (static_cast<unsigned char>(c) >= 0x80) c = '?';
    }
  }
  return words;
}

}  // namespace

void RunLog::Begin(const std::string& name) {
  End();
  stages_.push_back({name, 0, 0, 0});
  running_ = true;
  earlier_wall_s_ = earlier_cpu_s_ = 0;
  cpu_start_s_ = CpuSeconds();
  start_ = std::chrono::steady_clock::now();
}

void RunLog::End() {
  if (!running_) return;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start_;
  stages_.back().wall_s = earlier_wall_s_ + wall.count();
  stages_.back().cpu_s = earlier_cpu_s_ + CpuSeconds() - cpu_start_s_;
  stages_.back().peak_rss_kib = static_cast<long>(PeakMemoryBytesWithPrograms() >> 10);
  running_ = false;
}

void RunLog::AddEarlier(double wall_s, double cpu_s) {
  earlier_wall_s_ += wall_s;
  earlier_cpu_s_ += cpu_s;
}

io::RunRecord RunLog::Record(std::vector<std::string> lines) const {
  io::RunRecord record;
  record.command = CommandLineInUtf8();
  record.stages = stages_;
  record.threads = ThreadLimit::Current();
  record.log = std::move(lines);
  return record;
}

}  // namespace dtr::pipeline
