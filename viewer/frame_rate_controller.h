// viewer/frame_rate_controller.h -- how much smaller images must be while the camera moves.
#pragma once
#include <algorithm>

namespace dtr::viewer {

/// Chooses by how much each side of a moving image is divided, so that a frame takes no longer
/// than a target. Learns from the frames drawn, whatever machine, method or set it is.
class ResolutionFrameRateController {
 public:
  static constexpr int kMaxDivisor = 8;

  /// `target_ms`: what a moving frame may take. `max_divisor`, 1 to kMaxDivisor: images are
  /// never made smaller than that, whatever they take.
  explicit ResolutionFrameRateController(double target_ms, int max_divisor = kMaxDivisor)
      : target_ms_(target_ms),
        max_divisor_(std::clamp(max_divisor, 1, kMaxDivisor)),
        divisor_(std::min(2, max_divisor_)) {}

  /// Divisor of the next moving frame.
  int divisor() const { return divisor_; }

  /// A frame with this divisor took so long. Times of the slowest of late decide about larger
  /// images, so that frames do not jump to and fro between two sizes.
  void Drawn(int divisor, double ms);

 private:
  double PredictedMs(int divisor) const;

  double target_ms_;
  int max_divisor_;
  int divisor_;
  double typical_ms_ = 0;  ///< of frames at divisor_, smoothed; 0: none yet
  int calm_frames_ = 0;    ///< in a row for which a larger image would have been fast enough
};

}  // namespace dtr::viewer
