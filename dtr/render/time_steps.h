// dtr/render/time_steps.h -- dynamic sets: several frames, of which an image shows one.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "dtr/render/scene.h"
#include "dtr/types/dtr_set.h"

namespace dtr {

/// The set as it was in frame `index`: that frame alone, with the set's centre, bounds and
/// metadata. Points behind the calibration belong to frame 0 and stay with it. Throws UsageError
/// where the set has no such frame.
DtrSet AtFrame(const DtrSet& set, size_t index);

/// Every frame as AtFrame gives it. Pixels are moved, not copied.
std::vector<DtrSet> SplitFrames(DtrSet set);

/// Throws UsageError unless the set has exactly one frame: what knows still scenes alone must not
/// quietly take a moving one for its first frame.
void RequireOneFrame(const DtrSet& set);

/// DescribeRenderScene of every frame; the views are those of `set`. Throws as that, also
/// UsageError for an excluded name that one of the frames does not have.
std::vector<RenderScene> DescribeFrames(const DtrSet& set,
                                        std::span<const std::string> excluded_names = {});

/// The frame that image `i` of `images` shows when they run through all `frames` from the
/// first to the last, each for an equal share of the images.
size_t TimeStepOfImage(size_t i, size_t images, size_t frames);

/// Which frame is shown when a set is played round and round: each until the next one's time, the
/// last as long as the others on average. Where times do not rise, as in sets without any, all
/// frames last alike.
class FrameClock {
 public:
  static constexpr double kUntimedPerSecond = 24;  ///< as `dtr render` makes videos

  FrameClock() : FrameClock(DtrSet()) {}
  /// Frame::time_s of the set; one without frames counts as one of a single frame.
  explicit FrameClock(const DtrSet& set);

  size_t frames() const { return starts_s_.size(); }
  /// Seconds from the first frame's start to this one's.
  double StartOf(size_t frame) const { return starts_s_.at(frame); }
  double period_s() const { return period_s_; }
  /// `seconds` since some start of the first frame; any number.
  size_t FrameAt(double seconds) const;

 private:
  std::vector<double> starts_s_{0};
  double period_s_ = 1 / kUntimedPerSecond;
};

}  // namespace dtr
