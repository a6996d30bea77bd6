#include "dtr/eval/edge_scores.h"

#include <algorithm>
#include <cmath>

namespace dtr::eval {
namespace {

/// A jump: so many pixels of disparity (a window's width of foreground would hide the background)
/// and so large a ratio of depths (steep surfaces step by less from pixel to pixel).
constexpr double kJumpPx = 2.0, kJumpRatio = 1.05;
constexpr int kReach = 8;

/// One row or column of both maps, seen from the first pixel of an edge; step 1 leads to the
/// second.
struct Line {
  const DepthImage *estimate, *truth;
  int x, y, dx, dy;

  float At(const DepthImage& map, int step) const {
    const int u = x + step * dx, v = y + step * dy;
    return map.Contains(u, v) ? map(u, v) : 0.0f;
  }
};

struct EdgePlace {
  bool found = false;
  double offset = 0;  ///< of the estimated edge from the true one, towards the second pixel
};

/// `middle`: true depth between the two surfaces. Pixels on either side of it are near or far.
EdgePlace FindEdge(const Line& line, double middle, double set_units_per_truth_unit) {
  const bool first_is_near = line.At(*line.truth, 0) < middle;
  const auto goes_on = [&](int step) {
    const float z = line.At(*line.truth, step);
    return !DepthImage::IsHole(z) && ((z < middle) == first_is_near) == (step <= 0);
  };
  int before = 0, after = 0;  // pixels of the section on either side
  while (before < kReach && goes_on(-before)) ++before;
  while (after < kReach && goes_on(1 + after)) ++after;

  // looks[i]: +1 like the first surface, -1 like the second, 0 no estimate; i counts from -before.
  int looks[2 * kReach] = {};
  int firsts = 0, seconds = 0;
  for (int i = 0; i < before + after; ++i) {
    const float z = line.At(*line.estimate, i - before + 1);
    if (DepthImage::IsHole(z)) continue;
    const bool near = z < middle * set_units_per_truth_unit;
    looks[i] = near == first_is_near ? 1 : -1;
    (looks[i] > 0 ? firsts : seconds)++;
  }
  if (firsts == 0 || seconds == 0) return {};
  // Edge before pixel p: the wrong ones are seconds before p and firsts from p on.
  int wrong = firsts, least = firsts, lowest = 0, highest = 0;
  for (int p = 1; p <= before + after; ++p) {
    wrong -= looks[p - 1];
    if (wrong < least) least = wrong, lowest = p;
    if (wrong == least) highest = p;
  }
  return {true, 0.5 * (lowest + highest) - before};
}

}  // namespace

void EdgeScorer::Add(const DepthImage& estimate, const DepthImage& truth, const Mask& scored,
                     double set_units_per_truth_unit, double px_per_inverse_depth) {
  const auto counts = [&](int x, int y) {
    return truth.Contains(x, y) && !DepthImage::IsHole(truth(x, y)) &&
           (scored.empty() || scored(x, y) != 0);
  };
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (!counts(x, y)) continue;
      for (const auto& [dx, dy] : {std::pair(1, 0), {0, 1}}) {
        if (!counts(x + dx, y + dy)) continue;
        const double a = truth(x, y), b = truth(x + dx, y + dy);
        const double jump_px =
            px_per_inverse_depth * std::abs(1 / a - 1 / b) / set_units_per_truth_unit;
        if (jump_px < kJumpPx || std::max(a, b) < kJumpRatio * std::min(a, b)) continue;
        ++edges_;
        const double middle = 2 / (1 / a + 1 / b);
        const EdgePlace place =
            FindEdge({&estimate, &truth, x, y, dx, dy}, middle, set_units_per_truth_unit);
        if (!place.found) continue;
        ++found_;
        displacement_sum_ += std::abs(place.offset);
        fattening_sum_ += a < b ? place.offset : -place.offset;
      }
    }
  }
}

EdgeScores EdgeScorer::Scores() const {
  EdgeScores scores;
  if (edges_ == 0) return scores;
  scores.found_share = static_cast<double>(found_) / static_cast<double>(edges_);
  if (found_ == 0) return scores;
  scores.displacement_px = displacement_sum_ / static_cast<double>(found_);
  scores.fattening_px = fattening_sum_ / static_cast<double>(found_);
  return scores;
}

}  // namespace dtr::eval
