#include "stereo/side_by_side.h"

#include <algorithm>
#include <mutex>
#include <string>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr::stereo {

int ViewsAtOnce(const Collection& c, std::span<const int> views, bool filters) {
  const int threads = ResolveThreads(c.options.threads);
  std::uint64_t largest = 1;
  for (const int v : views) {
    const std::span<const int> neighbours = c.neighbours[static_cast<size_t>(v)].views;
    if (c.engine->WorkBytes(c.views, v, neighbours) == 0) return 1;
    largest = std::max(largest, LeastBytes(c.views, *c.engine, v, neighbours,
                                           static_cast<bool>(c.load_pixels), filters));
  }
  if (c.pages == nullptr) return threads;
  return static_cast<int>(std::clamp<std::uint64_t>(c.pages->limit() / largest, 1,
                                                    static_cast<std::uint64_t>(threads)));
}

void SideBySide(size_t count, int at_once, Progress& progress,
                const std::function<void(size_t k, std::string* note)>& body) {
  std::vector<std::string> notes(count);
  std::mutex mutex;
  int done = 0;
  ParallelFor(0, static_cast<int>(count), at_once, [&](int k) {
    progress.ThrowIfInterrupted();
    body(static_cast<size_t>(k), &notes[static_cast<size_t>(k)]);
    const std::lock_guard lock(mutex);  // the count reported only grows
    progress.Update(++done);
  });
  for (const std::string& note : notes) {
    if (!note.empty()) progress.Note(note);
  }
}

}  // namespace dtr::stereo
