// viewer/governor.h -- how much smaller pictures must be while the camera moves.
#pragma once
#include <algorithm>

namespace dtr::viewer {

/// Chooses by how much each side of a moving picture is divided, so that a frame takes no longer
/// than a target. Learns from the frames drawn, whatever machine, method or set it is.
class ResolutionGovernor {
 public:
  static constexpr int kMostDivisor = 8;

  /// `target_ms`: what a moving frame may take. `most_divisor`, 1 to kMostDivisor: pictures are
  /// never made smaller than that, whatever they take.
  explicit ResolutionGovernor(double target_ms, int most_divisor = kMostDivisor)
      : target_ms_(target_ms),
        most_divisor_(std::clamp(most_divisor, 1, kMostDivisor)),
        divisor_(std::min(2, most_divisor_)) {}

  /// Divisor of the next moving frame.
  int divisor() const { return divisor_; }

  /// A frame with this divisor took so long. Times of the slowest of late decide about larger
  /// pictures, so that frames do not jump to and fro between two sizes.
  void Drawn(int divisor, double ms);

 private:
  double PredictedMs(int divisor) const;

  double target_ms_;
  int most_divisor_;
  int divisor_;
  double typical_ms_ = 0;  ///< of frames at divisor_, smoothed; 0: none yet
  int calm_frames_ = 0;    ///< in a row for which a larger picture would have been fast enough
};

}  // namespace dtr::viewer
