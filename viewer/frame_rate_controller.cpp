#include "viewer/frame_rate_controller.h"

#include <algorithm>

namespace dtr::viewer {
namespace {

constexpr double kSmoothing = 0.3;    // of a new time in the typical one
constexpr double kComfort = 0.75;     // share of the target that a larger image may be predicted at
constexpr int kCalmFrames = 8;        // before a larger image is tried
constexpr double kJumpFactor = 1.25;  // over the target: act at once

}  // namespace

double ResolutionFrameRateController::PredictedMs(int divisor) const {
  // By pixels; what does not depend on them only makes larger images cheaper than predicted.
  const double side = static_cast<double>(divisor_) / divisor;
  return typical_ms_ * side * side;
}

void ResolutionFrameRateController::Drawn(int divisor, double ms) {
  if (divisor != divisor_ || !(ms >= 0)) return;
  typical_ms_ = typical_ms_ > 0 ? (1 - kSmoothing) * typical_ms_ + kSmoothing * ms : ms;
  if (ms > kJumpFactor * target_ms_ || typical_ms_ > target_ms_) {
    typical_ms_ = std::max(typical_ms_, ms);
    int smaller = divisor_ + 1;
    while (smaller < max_divisor_ && PredictedMs(smaller) > target_ms_) ++smaller;
    divisor_ = std::min(smaller, max_divisor_);
    typical_ms_ = 0;
    calm_frames_ = 0;
    return;
  }
  if (divisor_ == 1) return;
  calm_frames_ = PredictedMs(divisor_ - 1) <= kComfort * target_ms_ ? calm_frames_ + 1 : 0;
  if (calm_frames_ < kCalmFrames) return;
  typical_ms_ = PredictedMs(divisor_ - 1);
  --divisor_;
  calm_frames_ = 0;
}

}  // namespace dtr::viewer
