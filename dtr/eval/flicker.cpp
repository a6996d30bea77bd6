#include "dtr/eval/flicker.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dtr::eval {
namespace {

/// True depths that differ by more are of something that moves.
constexpr float kSameDepth = 1e-5f;  // relative; float has 6e-8, written worlds some more

}  // namespace

void ViewFlicker::Add(const DepthImage& estimate, const DepthImage& truth, const Mask& scored) {
  const int w = truth.width(), h = truth.height();
  if (estimate.width() != w || estimate.height() != h ||
      (!scored.empty() && (scored.width() != w || scored.height() != h)) ||
      (steps_ > 0 && (pixels_.width() != w || pixels_.height() != h))) {
    throw std::invalid_argument("flicker: expected grids of one size");
  }
  if (steps_ == 0) pixels_ = Grid<Pixel>(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      Pixel& pixel = pixels_(x, y);
      const float z = truth(x, y);
      const bool counts = !DepthImage::IsHole(z) && (scored.empty() || scored(x, y) != 0);
      if (steps_ == 0) pixel.truth = counts ? z : 0;
      if (!counts || std::abs(z - pixel.truth) > kSameDepth * z) pixel.truth = 0;
      if (pixel.truth == 0) continue;
      const bool has_depth = !DepthImage::IsHole(estimate(x, y));
      pixel.changes += steps_ > 0 && has_depth != pixel.had_depth;
      pixel.had_depth = has_depth;
      if (!has_depth) continue;
      const auto found = static_cast<double>(estimate(x, y));
      pixel.sum += found;
      pixel.squares += found * found;
      ++pixel.seen;
    }
  }
  ++steps_;
}

FlickerScores FlickerOf(const std::vector<ViewFlicker>& views) {
  FlickerScores scores;
  std::vector<double> deviations;
  long long changes = 0, chances = 0;
  for (const ViewFlicker& view : views) {
    for (const ViewFlicker::Pixel& pixel : view.pixels_.data()) {
      if (pixel.truth == 0) continue;
      ++scores.still_pixels;
      changes += pixel.changes;
      chances += view.steps_ - 1;
      if (pixel.seen < 2 || 2 * pixel.seen < view.steps_) continue;
      const double mean = pixel.sum / pixel.seen;
      const double variance = std::max(0.0, pixel.squares / pixel.seen - mean * mean);
      deviations.push_back(std::sqrt(variance) / mean);
    }
  }
  scores.pixels = static_cast<long long>(deviations.size());
  if (chances > 0) {
    scores.come_and_go_share = static_cast<double>(changes) / static_cast<double>(chances);
  }
  if (deviations.empty()) return scores;
  double sum = 0;
  for (const double deviation : deviations) sum += deviation;
  scores.mean_relative_deviation = sum / static_cast<double>(deviations.size());
  const auto middle = deviations.begin() + static_cast<long>(deviations.size() / 2);
  std::nth_element(deviations.begin(), middle, deviations.end());
  scores.median_relative_deviation = *middle;
  return scores;
}

}  // namespace dtr::eval
