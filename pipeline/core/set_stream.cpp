#include "pipeline/core/set_stream.h"

#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "dtr/base/memory_budget.h"
#include "dtr/io/set_io.h"

namespace dtr::pipeline {
namespace {

/// A view that made room for others is read again, and would be complained of again.
std::function<void(const std::string&)> SayOnce(Progress& console) {
  struct Said {
    std::mutex mutex;
    std::set<std::string> lines;
  };
  return [&console, said = std::make_shared<Said>()](const std::string& line) {
    const std::lock_guard lock(said->mutex);
    if (said->lines.insert(line).second) console.Note(line);
  };
}

}  // namespace

std::unique_ptr<ViewStream> StreamOf(const std::filesystem::path& folder, DtrSet& set,
                                     std::vector<RenderScene> described, const StreamLimits& limits,
                                     Progress& console) {
  ViewStream::Settings settings;
  settings.host_bytes =
      static_cast<size_t>(limits.view_bytes.value_or(limits.memory_gb * kBytesPerGigabyte));
  settings.warn = [&console](const std::string& line) { console.Note(line); };
  io::LoadOptions load;
  load.completed = !limits.measured_only;
  load.memory_gb = limits.memory_gb;
  load.warn = SayOnce(console);
  return std::make_unique<ViewStream>(
      set, std::move(described), [folder, load](View& view) { io::LoadPixels(folder, view, load); },
      std::move(settings));
}

}  // namespace dtr::pipeline
