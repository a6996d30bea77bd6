#include "dtr/cpu/raster.h"

#include <algorithm>
#include <cmath>

namespace dtr::cpu {
namespace {

constexpr double kSubpixels = 2048;

/// Signed area (twice) of a, b and p, the same up to the sign for (a, b) and (b, a): the ends are
/// put into one order first, so that both triangles at an edge see exactly opposite values.
struct Edge {
  double ax, ay, dx, dy, sign;
  bool owns_its_pixels;  // a top or left edge

  Edge(const ScreenVertex& a, const ScreenVertex& b) {
    const double dir_x = b.x - a.x, dir_y = b.y - a.y;
    owns_its_pixels = dir_y < 0 || (dir_y == 0 && dir_x > 0);
    const bool swap = b.y < a.y || (b.y == a.y && b.x < a.x);
    ax = swap ? b.x : a.x;
    ay = swap ? b.y : a.y;
    dx = swap ? -dir_x : dir_x;
    dy = swap ? -dir_y : dir_y;
    sign = swap ? -1 : 1;
  }
  double At(double x, double y) const { return sign * (dx * (y - ay) - dy * (x - ax)); }
  bool Covers(double value) const { return value > 0 || (value == 0 && owns_its_pixels); }
};

void Keep(double inverse_depth, size_t index, Layer& layer) {
  double& nearest = layer.inverse_depth[index];
  nearest = std::max(nearest, inverse_depth);
}

/// Pixels [first, last] whose centres lie in [low, high], cut to [0, count).
struct PixelRange {
  int first = 0, last = -1;
  PixelRange(double low, double high, int begin, int end) {
    // Comparisons before the casts: coordinates may be far outside the range of int.
    if (!(high >= begin) || !(low <= end)) return;
    first = std::max(begin, static_cast<int>(std::ceil(std::max(low, begin - 1.0) - 0.5)));
    last = std::min(end - 1, static_cast<int>(std::floor(std::min(high, end + 1.0) - 0.5)));
  }
};

size_t IndexOf(const Band& band, int x, int y) {
  return static_cast<size_t>(y - band.first_row) * static_cast<size_t>(band.width_px) +
         static_cast<size_t>(x);
}

}  // namespace

double SnapToSubpixel(double coordinate_px) {
  return std::floor(coordinate_px * kSubpixels + 0.5) / kSubpixels;
}

void DrawTriangle(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c,
                  Layer& layer) {
  const Band& band = layer.band;
  const PixelRange xs(std::min({a.x, b.x, c.x}), std::max({a.x, b.x, c.x}), 0, band.width_px);
  if (xs.first > xs.last) return;
  const PixelRange ys(std::min({a.y, b.y, c.y}), std::max({a.y, b.y, c.y}), band.first_row,
                      band.first_row + band.rows);
  if (ys.first > ys.last) return;
  if (!((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0)) return;

  const Edge bc(b, c), ca(c, a), ab(a, b);
  const double lowest = std::min({a.inverse_depth, b.inverse_depth, c.inverse_depth});
  const double highest = std::max({a.inverse_depth, b.inverse_depth, c.inverse_depth});
  for (int y = ys.first; y <= ys.last; ++y) {
    for (int x = xs.first; x <= xs.last; ++x) {
      const double px = x + 0.5, py = y + 0.5;
      const double wa = bc.At(px, py), wb = ca.At(px, py), wc = ab.At(px, py);
      if (!bc.Covers(wa) || !ca.Covers(wb) || !ab.Covers(wc)) continue;
      const double inverse_depth =
          (wa * a.inverse_depth + wb * b.inverse_depth + wc * c.inverse_depth) / (wa + wb + wc);
      Keep(std::clamp(inverse_depth, lowest, highest), IndexOf(band, x, y), layer);
    }
  }
}

void DrawSquare(const ScreenVertex& center, double half_px, Layer& layer) {
  const Band& band = layer.band;
  const double left = center.x - half_px, right = center.x + half_px;
  const double top = center.y - half_px, bottom = center.y + half_px;
  const PixelRange xs(left, right, 0, band.width_px);
  const PixelRange ys(top, bottom, band.first_row, band.first_row + band.rows);
  for (int y = ys.first; y <= ys.last; ++y) {
    if (y + 0.5 >= bottom) break;  // half open
    for (int x = xs.first; x <= xs.last && x + 0.5 < right; ++x) {
      Keep(center.inverse_depth, IndexOf(band, x, y), layer);
    }
  }
}

}  // namespace dtr::cpu
