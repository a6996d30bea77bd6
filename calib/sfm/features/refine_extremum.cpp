#include "calib/sfm/features/refine_extremum.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dtr::sfm {
namespace {

/// A fit whose extremum is further away from the pixel or the scale is none; VLFeat's.
constexpr double kMaxOffset = 1.5;
/// Beyond this offset the next pixel is nearer; above 1/2 so that steps do not alternate.
constexpr double kStepFrom = 0.6;

/// Value and derivatives of a difference of Gaussians by central differences.
struct Fit {
  double value;
  double x, y, s;
  double xx, yy, ss, xy, xs, ys;
};

Fit FitAt(const Octave& octave, int scale, int x, int y) {
  std::array<std::array<std::array<double, 3>, 3>, 3> d;  // scale, row, column
  for (int s = 0; s < 3; ++s) {
    const RowStore& a = octave.levels[static_cast<size_t>(scale - 1 + s)];
    const RowStore& b = octave.levels[static_cast<size_t>(scale + s)];
    for (int r = 0; r < 3; ++r) {
      const float* from = a.row(y - 1 + r) + x - 1;
      const float* to = b.row(y - 1 + r) + x - 1;
      auto& row = d[static_cast<size_t>(s)][static_cast<size_t>(r)];
      for (size_t c = 0; c < 3; ++c) row[c] = to[c] - from[c];
    }
  }
  Fit fit;
  const double twice = 2 * d[1][1][1];
  fit.value = d[1][1][1];
  fit.x = 0.5 * (d[1][1][2] - d[1][1][0]);
  fit.y = 0.5 * (d[1][2][1] - d[1][0][1]);
  fit.s = 0.5 * (d[2][1][1] - d[0][1][1]);
  fit.xx = d[1][1][2] + d[1][1][0] - twice;
  fit.yy = d[1][2][1] + d[1][0][1] - twice;
  fit.ss = d[2][1][1] + d[0][1][1] - twice;
  fit.xy = 0.25 * (d[1][2][2] + d[1][0][0] - d[1][0][2] - d[1][2][0]);
  fit.xs = 0.25 * (d[2][1][2] + d[0][1][0] - d[0][1][2] - d[2][1][0]);
  fit.ys = 0.25 * (d[2][2][1] + d[0][0][1] - d[0][2][1] - d[2][0][1]);
  return fit;
}

struct Offset {
  double x, y, s;
};

/// Where the fit's gradient is 0, by Cramer's rule; empty for a fit that has no such position, and
/// for NaN.
std::optional<Offset> ExtremumOf(const Fit& f) {
  const double yy_ss = f.yy * f.ss - f.ys * f.ys;
  const double xy_ss = f.xy * f.ss - f.ys * f.xs;
  const double xy_ys = f.xy * f.ys - f.yy * f.xs;
  const double det = f.xx * yy_ss - f.xy * xy_ss + f.xs * xy_ys;
  if (!(std::abs(det) > 0)) return std::nullopt;
  const double xx_ss = f.xx * f.ss - f.xs * f.xs;
  const double xx_ys = f.xx * f.ys - f.xy * f.xs;
  const double xx_yy = f.xx * f.yy - f.xy * f.xy;
  return Offset{-(yy_ss * f.x - xy_ss * f.y + xy_ys * f.s) / det,
                -(-xy_ss * f.x + xx_ss * f.y - xx_ys * f.s) / det,
                -(xy_ys * f.x - xx_ys * f.y + xx_yy * f.s) / det};
}

int StepBy(double offset, int at, int size) {
  if (offset > kStepFrom && at < size - 2) return 1;
  return offset < -kStepFrom && at > 1 ? -1 : 0;
}

bool IsFeature(const Fit& fit, const Offset& offset, const ExtremumLimits& limits) {
  const double contrast =
      fit.value + 0.5 * (fit.x * offset.x + fit.y * offset.y + fit.s * offset.s);
  const double trace = fit.xx + fit.yy, det = fit.xx * fit.yy - fit.xy * fit.xy;
  const double r = limits.max_curvature_ratio;
  const auto near = [](double o) { return std::abs(o) < kMaxOffset; };
  return std::abs(contrast) > limits.min_contrast && det > 0 &&
         trace * trace * r < (r + 1) * (r + 1) * det &&  // Lowe, sec. 4.1
         near(offset.x) && near(offset.y) && near(offset.s);
}

}  // namespace

std::optional<Extremum> RefineExtremum(const Octave& octave, int scale, int x, int y,
                                       const ExtremumLimits& limits) {
  for (int step = 0;; ++step) {
    const Fit fit = FitAt(octave, scale, x, y);
    const auto offset = ExtremumOf(fit);
    if (!offset) return std::nullopt;
    const int dx = StepBy(offset->x, x, octave.width), dy = StepBy(offset->y, y, octave.height);
    if ((dx == 0 && dy == 0) || step == kRefineSteps - 1) {
      if (!IsFeature(fit, *offset, limits)) return std::nullopt;
      Extremum found;
      found.level = scale;
      found.x = static_cast<float>(x + offset->x);
      found.y = static_cast<float>(y + offset->y);
      found.sigma =
          static_cast<float>(kFirstSigma * std::exp2((scale + offset->s) / kScalesPerOctave));
      const bool inside = found.x >= 0 && found.y >= 0 &&
                          found.x <= static_cast<float>(octave.width - 1) &&
                          found.y <= static_cast<float>(octave.height - 1);
      return inside ? std::optional(found) : std::nullopt;
    }
    x += dx;
    y += dy;
  }
}

}  // namespace dtr::sfm
