#include "tests/fuzz/outcome.h"

#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <stdexcept>

#include "dtr/base/error.h"
#include "tests/fuzz/memory_watch.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr int kEndlessS = 20;  // then the process ends by SIGPROF, and the input stays

double CpuS() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void Put(const fs::path& file, std::string_view bytes) {
  const int fd = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  const bool whole =
      fd >= 0 && write(fd, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
  if (fd < 0 || close(fd) != 0 || !whole) throw std::runtime_error("no room for fuzzed inputs");
}

void EndAfter(int seconds) {
  const itimerval timer{{0, 0}, {seconds, 0}};
  setitimer(ITIMER_PROF, &timer, nullptr);
}

// The words of a rejection must be one line, so that a program can show them.
std::string ErrorOfWords(const std::string& words) {
  if (words.empty()) return "rejected without a word";
  for (const char c : words) {
    if (c == '\n' || c == '\r' || c == '\0') return "rejected in more than one line: " + words;
  }
  return "";
}

}  // namespace

Outcome TryInput(const Reader& reader, std::string_view input) {
  Put(reader.file, input);
  Outcome outcome;
  EndAfter(kEndlessS);
  const double start_s = CpuS();
  const MemoryWatch memory;
  try {
    reader.read();
    outcome.accepted = true;
  } catch (const Error& error) {
    outcome.error_text = ErrorOfWords(error.what());
  } catch (const std::exception& error) {
    outcome.error_text = std::string("threw something else than Error: ") + error.what();
  }
  const long peak_bytes = memory.PeakBytes();
  const double used_s = CpuS() - start_s;
  EndAfter(0);
  if (peak_bytes > AllowedBytes(input.size()) + reader.buffer_bytes) {
    outcome.error_text = "allocated " + std::to_string(peak_bytes) + " bytes for an input of " +
                         std::to_string(input.size());
  } else if (used_s > kHangS) {
    outcome.error_text = "took " + std::to_string(used_s) + " s";
  }
  return outcome;
}

fs::path MakeFolder() {
  const fs::path memory = "/dev/shm";
  const bool usable = access(memory.c_str(), W_OK | X_OK) == 0;
  std::string pattern =
      ((usable ? memory : fs::temp_directory_path()) / "dtr_fuzz_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  return pattern;
}

}  // namespace dtr::fuzz
