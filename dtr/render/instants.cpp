#include "dtr/render/instants.h"

#include <string>

#include "dtr/base/error.h"

namespace dtr {

DtrSet AtFrame(const DtrSet& set, size_t index) {
  if (index >= set.frames.size()) {
    throw UsageError("--frame " + std::to_string(index) + ": expected 0 to " +
                     std::to_string(set.frames.size() - 1) + ", the set has " +
                     std::to_string(set.frames.size()) +
                     (set.frames.size() == 1 ? " frame" : " frames"));
  }
  DtrSet still = set;
  still.frames = {set.frames[index]};
  if (index > 0) still.sparse_file.reset();
  return still;
}

void RequireOneFrame(const DtrSet& set) {
  if (set.frames.empty()) throw Error("set: expected at least one frame, found none");
  if (set.frames.size() == 1) return;
  throw UsageError("set: expected one frame, found " + std::to_string(set.frames.size()) +
                   "; moving sets are for `dtr render` (--frame) and `dtr info`");
}

size_t FrameOfPicture(size_t i, size_t pictures, size_t frames) { return i * frames / pictures; }

}  // namespace dtr
