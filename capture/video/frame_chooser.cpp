#include "capture/video/frame_chooser.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace dtr::capture {
namespace {

constexpr double kWindowBegins = 0.75, kWindowEnds = 1.25;  // of the wanted motion
constexpr double kStartWindow = 0.5;   // where nothing was kept yet: sharpness before distance
constexpr double kLost = 0.3;          // share of corners still followed
constexpr size_t kLongestWindow = 64;  // frames in memory

// The mean over cameras that have something to follow; nothing where none has.
std::optional<FrameMotion::State> Followed(std::vector<FrameMotion>& cameras,
                                           const TimeStep& time_step) {
  FrameMotion::State mean{0, 0};
  int count = 0;
  for (size_t i = 0; i < cameras.size(); ++i) {
    const FrameMotion::State state = cameras[i].Follow(time_step.greys[i]);
    if (!cameras[i].has_texture()) continue;
    mean.moved += state.moved;
    mean.kept += state.kept;
    ++count;
  }
  if (count == 0) return {};
  return FrameMotion::State{mean.moved / count, mean.kept / count};
}

}  // namespace

FrameChooser::FrameChooser(double motion) : motion_(motion) {
  if (!(motion > 0 && motion <= 1)) throw std::invalid_argument("FrameChooser: motion");
}

void FrameChooser::Add(TimeStep time_step) { Consider({std::move(time_step), 0, 0, false}); }

void FrameChooser::Follow(const TimeStep& time_step) {
  followed_.clear();
  for (const auto& grey : time_step.greys) followed_.emplace_back(grey);
}

// Nothing is kept that this frame could be measured by: following begins here, if there is anything
// to follow.
void FrameChooser::BeginAt(Waiting waiting) {
  Follow(waiting.time_step);
  anchor_is_kept_ = false;
  const bool textured = std::any_of(followed_.begin(), followed_.end(),
                                    [](const auto& camera) { return camera.has_texture(); });
  if (textured) Open(std::move(waiting), 0, true);
}

// Puts a frame into the window; a window begins with a candidate.
void FrameChooser::Open(Waiting waiting, double moved, bool candidate) {
  if (window_.empty() && !candidate) return;
  if (waiting.time_step.sharpness) {  // asked once, while the frame's pixels are there
    waiting.sharpness = waiting.time_step.sharpness();
    waiting.time_step.sharpness = nullptr;
  }
  waiting.moved = moved;
  waiting.candidate = candidate;
  window_.push_back(std::move(waiting));
}

// Keeps the window's sharpest candidate and returns the frames after it, which are to be looked at
// again: they are measured from another frame now.
std::vector<FrameChooser::Waiting> FrameChooser::Close() {
  std::vector<Waiting> window = std::move(window_);
  window_.clear();
  const auto best =
      std::max_element(window.begin(), window.end(), [](const auto& a, const auto& b) {
        return std::pair(a.candidate, a.sharpness) < std::pair(b.candidate, b.sharpness);
      });
  chosen_.push_back({best->time_step.number, best->time_step.time_s, best->moved, best->sharpness});
  Follow(best->time_step);
  anchor_is_kept_ = true;
  window.erase(window.begin(), best + 1);
  return window;
}

void FrameChooser::Consider(Waiting waiting) {
  const auto state = Followed(followed_, waiting.time_step);
  if (!state) return BeginAt(std::move(waiting));
  const double begins = anchor_is_kept_ ? kWindowBegins * motion_ : 0;
  const double ends = (anchor_is_kept_ ? kWindowEnds : kStartWindow) * motion_;
  if (state->kept >= kLost && state->moved <= ends && window_.size() < kLongestWindow) {
    return Open(std::move(waiting), anchor_is_kept_ ? state->moved : 0, state->moved >= begins);
  }
  if (window_.empty()) return BeginAt(std::move(waiting));  // a cut, or too fast for the window
  for (Waiting& later : Close()) Consider(std::move(later));
  Consider(std::move(waiting));
}

std::vector<ChosenFrame> FrameChooser::Finish() {
  while (!window_.empty()) {
    for (Waiting& later : Close()) Consider(std::move(later));
  }
  return std::move(chosen_);
}

std::vector<ChosenFrame> Thinned(const std::vector<ChosenFrame>& frames, int most) {
  if (most <= 0 || frames.size() <= static_cast<size_t>(most)) return frames;
  const auto parts = static_cast<size_t>(most);
  std::vector<ChosenFrame> thinned;
  for (size_t part = 0; part < parts; ++part) {
    const auto at = [&](size_t p) {
      return frames.begin() + static_cast<std::ptrdiff_t>(p * frames.size() / parts);
    };
    thinned.push_back(*std::max_element(at(part), at(part + 1), [](const auto& a, const auto& b) {
      return a.sharpness < b.sharpness;
    }));
  }
  return thinned;
}

}  // namespace dtr::capture
