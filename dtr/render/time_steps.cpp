#include "dtr/render/time_steps.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "dtr/base/error.h"

namespace dtr {

DtrSet AtFrame(const DtrSet& set, size_t index) {
  if (index >= set.frames.size()) {
    throw UsageError("`frame` " + std::to_string(index) + ": expected 0 to " +
                     std::to_string(set.frames.size() - 1) + ", the set has " +
                     std::to_string(set.frames.size()) +
                     (set.frames.size() == 1 ? " frame" : " frames"));
  }
  // Without the other frames, however many there are.
  const auto& [unit, origin, center, bounds, frames, sparse, provenance, validation, extra] = set;
  DtrSet still{unit, origin, center, bounds, {}, sparse, provenance, validation, extra};
  still.frames.push_back(frames[index]);
  if (index > 0) still.sparse_file.reset();
  return still;
}

std::vector<DtrSet> SplitFrames(DtrSet set) {
  std::vector<Frame> frames = std::exchange(set.frames, {});
  std::vector<DtrSet> stills;
  for (size_t i = 0; i < frames.size(); ++i) {
    stills.push_back(set);
    stills.back().frames.push_back(std::move(frames[i]));
    if (i > 0) stills.back().sparse_file.reset();
  }
  return stills;
}

void RequireOneFrame(const DtrSet& set) {
  if (set.frames.empty()) throw Error("set: expected at least one frame, found none");
  if (set.frames.size() == 1) return;
  throw UsageError("set: expected one frame, found " + std::to_string(set.frames.size()) +
                   "; dynamic sets are for dtr render, dtr view (`frame`) and dtr info");
}

std::vector<RenderScene> DescribeFrames(const DtrSet& set,
                                        std::span<const std::string> excluded_names) {
  std::vector<RenderScene> scenes;
  for (size_t i = 0; i < set.frames.size(); ++i) {
    const DtrSet still = AtFrame(set, i);
    const std::vector<View>&copies = still.frames.front().views, &own = set.frames[i].views;
    RenderScene scene = DescribeRenderScene(still, excluded_names);
    for (const View*& view : scene.views) view = &own[static_cast<size_t>(view - copies.data())];
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

size_t TimeStepOfImage(size_t i, size_t pictures, size_t frames) { return i * frames / pictures; }

FrameClock::FrameClock(const DtrSet& set) {
  const size_t count = set.frames.size();
  if (count < 2) return;
  const auto later = [](const Frame& a, const Frame& b) { return !(a.time_s < b.time_s); };
  const bool timed =
      std::adjacent_find(set.frames.begin(), set.frames.end(), later) == set.frames.end();
  starts_s_.clear();
  for (size_t i = 0; i < count; ++i) {
    starts_s_.push_back(timed ? set.frames[i].time_s - set.frames[0].time_s
                              : static_cast<double>(i) / kUntimedPerSecond);
  }
  period_s_ = starts_s_.back() * static_cast<double>(count) / static_cast<double>(count - 1);
}

size_t FrameClock::FrameAt(double seconds) const {
  if (!std::isfinite(seconds)) return 0;
  double within = std::fmod(seconds, period_s_);
  if (within < 0) within += period_s_;
  const auto next = std::upper_bound(starts_s_.begin(), starts_s_.end(), within);
  return static_cast<size_t>(next - starts_s_.begin()) - 1;
}

}  // namespace dtr
