#include "stereo/side_by_side.h"

#include <algorithm>
#include <string>
#include <vector>

#include "dtr/base/counted_for.h"
#include "dtr/base/parallel_for.h"

namespace dtr::stereo {

int ViewsAtOnce(const Collection& c, std::span<const int> views, bool filters) {
  const int threads = ThreadLimit::Current();
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
  CountedFor(static_cast<int>(count), at_once, progress,
             [&](int k) { body(static_cast<size_t>(k), &notes[static_cast<size_t>(k)]); });
  for (const std::string& note : notes) {
    if (!note.empty()) progress.Note(note);
  }
}

}  // namespace dtr::stereo
