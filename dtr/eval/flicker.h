// dtr/eval/flicker.h -- how much depth changes over time where nothing moves.
#pragma once
#include <optional>
#include <vector>

#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"

namespace dtr::eval {

/// Figures over the pixels of fixed cameras whose true depth is the same at all time steps, that
/// the masks let through at all of them, and that have an estimated depth in at least half.
struct FlickerScores {
  long long still_pixels = 0;  ///< with such truth
  long long pixels = 0;        ///< of them, those with depth often enough
  /// Standard deviation of a pixel's depth over time, divided by its mean.
  std::optional<double> mean_relative_deviation, median_relative_deviation;
  /// Time steps, of all of these pixels, in which a pixel has a depth and had none in the step
  /// before, or the other way round.
  std::optional<double> come_and_go_share;
};

/// One view over time. Memory: 29 bytes per pixel.
class ViewFlicker {
 public:
  /// The next time step. Grids of one size at all of them; `scored`: 0 where truth does not count,
  /// empty: all does. Throws std::invalid_argument for other sizes.
  void Add(const DepthImage& estimate, const DepthImage& truth, const Mask& scored);

  friend FlickerScores FlickerOf(const std::vector<ViewFlicker>& views);

 private:
  struct Pixel {
    double sum = 0, squares = 0;
    float truth = 0;  ///< of the first time step; 0: does not count
    int seen = 0, changes = 0;
    bool had_depth = false;
  };
  Grid<Pixel> pixels_;
  int steps_ = 0;
};

FlickerScores FlickerOf(const std::vector<ViewFlicker>& views);

}  // namespace dtr::eval
