#include "stereo/patchmatch/planar_prior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr::stereo::patchmatch {
namespace {

/// Half sides of the windows, smallest first.
constexpr int kRadii[] = {8, 16, 32, 64};
/// Least share of a window's pixels that must be believed.
constexpr double kMinShare = 0.06;
/// The believed pixels' centre of mass may be so far off the pixel, in half sides, and they must
/// spread at least so much in every direction: else the plane is continued, not spanned.
constexpr double kMaxOffCentre = 0.35, kMinSpread = 0.25;
/// They lie on a plane when they miss it by no more than this, pixels of disparity.
constexpr double kMaxRmsPx = 1.5;
/// The pixel looks like them when it is within so many of their standard deviations, and levels.
constexpr double kLooksSigmas = 2.0, kLooksLevels = 6.0;
/// Inverse depths are known no better than this, and no plane fits better, pixels of disparity.
constexpr double kFloorPx = 0.3;
/// Rows that share their running sums. Sums are rounded alike whoever works them out.
constexpr int kBandRows = 32;

/// Weighted sums over a window: 1, x, y, xx, xy, yy, w, xw, yw, ww, grey, grey grey; and a count.
constexpr size_t kSums = 13;
using Sums = std::array<double, kSums>;

struct Plane {
  double w = 0, a = 0, b = 0, rms_px = 0;
};

/// Sums over columns of a window's height, moved down row by row, and their running totals.
class Band {
 public:
  Band(const PriorSupport& support, const Reference& picture, int radius)
      : support_(support),
        picture_(picture),
        radius_(radius),
        columns_(static_cast<size_t>(support.w.width())),
        totals_(static_cast<size_t>(support.w.width()) + 1) {}

  /// Must be called for a band's rows one after another.
  void MoveTo(int y, bool first) {
    if (first) {
      std::fill(columns_.begin(), columns_.end(), Sums{});
      for (int row = y - radius_; row <= y + radius_; ++row) Add(row, 1);
    } else {
      Add(y - radius_ - 1, -1);
      Add(y + radius_, 1);
    }
    totals_[0] = {};
    for (size_t x = 0; x < columns_.size(); ++x) {
      for (size_t i = 0; i < kSums; ++i) totals_[x + 1][i] = totals_[x][i] + columns_[x][i];
    }
  }

  Sums At(int x) const {
    const int width = static_cast<int>(columns_.size());
    const Sums& end = totals_[static_cast<size_t>(std::min(width, x + radius_ + 1))];
    const Sums& begin = totals_[static_cast<size_t>(std::max(0, x - radius_))];
    Sums sums;
    for (size_t i = 0; i < kSums; ++i) sums[i] = end[i] - begin[i];
    return sums;
  }

 private:
  void Add(int y, double sign) {
    if (y < 0 || y >= support_.w.height()) return;
    for (int x = 0; x < support_.w.width(); ++x) {
      const double w = support_.w(x, y);
      if (w == 0) continue;
      const double sigma = support_.sigma_px(x, y), grey = *picture_.grey.at(x, y);
      const double g = sign / (kFloorPx * kFloorPx + sigma * sigma);
      Sums& s = columns_[static_cast<size_t>(x)];
      s[0] += g, s[1] += g * x, s[2] += g * y;
      s[3] += g * x * x, s[4] += g * x * y, s[5] += g * y * y;
      s[6] += g * w, s[7] += g * x * w, s[8] += g * y * w, s[9] += g * w * w;
      s[10] += g * grey, s[11] += g * grey * grey;
      s[12] += sign;
    }
  }

  const PriorSupport& support_;
  const Reference& picture_;
  const int radius_;
  std::vector<Sums> columns_, totals_;
};

bool LooksLike(const Sums& s, double grey) {
  const double mean = s[10] / s[0], variance = std::max(0.0, s[11] / s[0] - mean * mean);
  return std::abs(grey - mean) <= kLooksSigmas * std::sqrt(variance) + kLooksLevels;
}

/// The plane through what is believed around (x, y), continued to it.
std::optional<Plane> FitAround(const Sums& s, int x, int y, int radius, double grey,
                               double px_per_w) {
  const double side = 2 * radius + 1;
  if (!(s[12] >= kMinShare * side * side)) return {};
  const double mx = s[1] / s[0], my = s[2] / s[0], mw = s[6] / s[0];
  if (std::max(std::abs(mx - x), std::abs(my - y)) > kMaxOffCentre * radius) return {};
  if (!LooksLike(s, grey)) return {};
  const double xx = s[3] / s[0] - mx * mx, xy = s[4] / s[0] - mx * my, yy = s[5] / s[0] - my * my;
  const double xw = s[7] / s[0] - mx * mw, yw = s[8] / s[0] - my * mw, ww = s[9] / s[0] - mw * mw;
  // The smaller eigenvalue: the spread across the direction in which it is least.
  const double least = 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy));
  if (!(least >= kMinSpread * kMinSpread * radius * radius)) return {};
  const double det = xx * yy - xy * xy;
  Plane plane;
  plane.a = (xw * yy - yw * xy) / det;
  plane.b = (yw * xx - xw * xy) / det;
  plane.w = mw + plane.a * (x - mx) + plane.b * (y - my);
  plane.rms_px = px_per_w * std::sqrt(std::max(0.0, ww - plane.a * xw - plane.b * yw));
  if (!(plane.rms_px <= kMaxRmsPx) || !(plane.w > 0)) return {};
  return plane;
}

}  // namespace

Prior PlanarPrior(const Grid<float>& wanted, const PriorSupport& support, const Reference& picture,
                  State* state) {
  const int width = wanted.width(), height = wanted.height();
  Prior prior{Grid<float>(width, height), Grid<float>(width, height)};
  const auto is_open = [&](int x, int y) { return wanted(x, y) != 0 && prior.w(x, y) == 0; };
  const auto any_open = [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < width; ++x) {
        if (is_open(x, y)) return true;
      }
    }
    return false;
  };
  const auto fit_row = [&](const Band& sums, int radius, int y) {
    for (int x = 0; x < width; ++x) {
      if (!is_open(x, y)) continue;
      const double px = support.px_per_w(x, y);
      const auto plane = FitAround(sums.At(x), x, y, radius, *picture.grey.at(x, y), px);
      if (!plane) continue;
      const double sigma = std::max(kFloorPx, plane->rms_px) / px;
      prior.w(x, y) = static_cast<float>(plane->w);
      prior.sigma(x, y) = static_cast<float>(sigma);
      if (std::abs(*state->w.at(x, y) - plane->w) <= sigma) continue;
      *state->w.at(x, y) = static_cast<float>(plane->w);
      *state->a.at(x, y) = static_cast<float>(plane->a);
      *state->b.at(x, y) = static_cast<float>(plane->b);
    }
  };
  ParallelFor(0, (height + kBandRows - 1) / kBandRows, [&](int band) {
    const int begin = band * kBandRows, end = std::min(height, begin + kBandRows);
    for (const int radius : kRadii) {
      if (!any_open(begin, end)) break;  // sums that unset for
      Band sums(support, picture, radius);
      for (int y = begin; y < end; ++y) {
        sums.MoveTo(y, y == begin);
        fit_row(sums, radius, y);
      }
    }
  });
  return prior;
}

}  // namespace dtr::stereo::patchmatch
