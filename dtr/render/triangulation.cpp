#include "dtr/render/triangulation.h"

#include <algorithm>
#include <cmath>

#include "dtr/render/scene.h"

namespace dtr {
namespace {

/// 0 off the grid: nothing continues there.
double ValueAt(const Grid<double>& grid, int x, int y) {
  return grid.Contains(x, y) ? grid(x, y) : 0;
}

/// True when the two samples exist and differ by `step` from the first to the second, up to
/// `tolerance`.
bool Continues(double from, double to, double step, double tolerance) {
  return from > 0 && to > 0 && std::abs((to - from) - step) <= tolerance;
}

/// A sample is drawn when at least one image pixel of its cell is usable.
bool CellUsable(const View& view, int depth_x, int depth_y) {
  if (view.mask.empty()) return true;
  const int s = view.depth_scale;
  for (int y = depth_y * s; y < (depth_y + 1) * s; ++y) {
    for (int x = depth_x * s; x < (depth_x + 1) * s; ++x) {
      if (view.mask(x, y) != 0) return true;
    }
  }
  return false;
}

}  // namespace

SampleGrid MakeSampleGrid(const View& view, int resolution) {
  SampleGrid samples;
  samples.step = resolution;
  samples.offset = resolution / 2;
  const auto count = [&](int pixels) {
    return pixels > samples.offset ? (pixels - samples.offset - 1) / resolution + 1 : 0;
  };
  const int columns = count(view.depth.width()), rows = count(view.depth.height());
  if (columns == 0 || rows == 0) return samples;
  samples.inverse_depth = Grid<double>(columns, rows);
  bool any = false;
  for (int j = 0; j < rows; ++j) {
    const int y = samples.offset + j * resolution;
    for (int i = 0; i < columns; ++i) {
      const int x = samples.offset + i * resolution;
      if (!CellUsable(view, x, y)) {
        if (samples.masked.empty()) samples.masked = Grid<std::uint8_t>(columns, rows);
        samples.masked(i, j) = 1;
        continue;
      }
      const float depth = view.depth(x, y);
      if (DepthImage::IsHole(depth)) continue;
      samples.inverse_depth(i, j) = 1.0 / static_cast<double>(depth);
      any = true;
    }
  }
  if (!any) {
    samples.inverse_depth = {};
    samples.masked = {};
  }
  return samples;
}

BreakRule BreakRuleOf(const View& view, const RenderOptions& options) {
  return {ThresholdsOf(view, options).depth_break, options.absolute_depth_break};
}

bool EdgeBreaks(const Grid<double>& inverse_depth, int x, int y, int dx, int dy,
                const BreakRule& rule) {
  const double w1 = inverse_depth(x, y), w2 = inverse_depth(x + dx, y + dy);
  if (rule.absolute_depth) return std::abs(1 / w1 - 1 / w2) > *rule.absolute_depth;
  const double step = w2 - w1, t = rule.inverse_depth;
  if (std::abs(step) <= t) return false;
  // SPEC 2.3: samples in line, two before and two after the edge.
  const double before2 = ValueAt(inverse_depth, x - 2 * dx, y - 2 * dy);
  const double before1 = ValueAt(inverse_depth, x - dx, y - dy);
  const double after1 = ValueAt(inverse_depth, x + 2 * dx, y + 2 * dy);
  const double after2 = ValueAt(inverse_depth, x + 3 * dx, y + 3 * dy);
  const bool straight_before = Continues(before1, w1, step, t);
  const bool straight_after = Continues(w2, after1, step, t);
  if (straight_before && straight_after) return false;
  if (straight_before && Continues(before2, before1, step, t)) return false;
  return !(straight_after && Continues(after1, after2, step, t));
}

BlockTriangles TrianglesOfBlock(const Grid<double>& inverse_depth, int x, int y,
                                const BreakRule& rule) {
  const double a = inverse_depth(x, y), b = inverse_depth(x + 1, y);
  const double c = inverse_depth(x, y + 1), d = inverse_depth(x + 1, y + 1);
  const bool has_a = a > 0, has_b = b > 0, has_c = c > 0, has_d = d > 0;
  BlockTriangles triangles;
  if (has_a + has_b + has_c + has_d < 3) return triangles;

  const double lowest = std::min({a, b, c, d}), highest = std::max({a, b, c, d});
  const bool level = lowest > 0 && !rule.absolute_depth && highest - lowest <= rule.inverse_depth;
  const bool ad_possible = has_a && has_d, bc_possible = has_b && has_c;
  const bool along_bc = bc_possible && (!ad_possible || std::abs(b - c) < std::abs(a - d));
  if (level) {  // no edge can break
    triangles.corners[0] = along_bc ? kA | kB | kC : kA | kB | kD;
    triangles.corners[1] = along_bc ? kB | kD | kC : kA | kD | kC;
    return triangles;
  }
  const auto joined = [&](bool both, int px, int py, int dx, int dy) {
    return both && !EdgeBreaks(inverse_depth, px, py, dx, dy, rule);
  };
  const bool ab = joined(has_a && has_b, x, y, 1, 0);
  const bool cd = joined(has_c && has_d, x, y + 1, 1, 0);
  const bool ac = joined(has_a && has_c, x, y, 0, 1);
  const bool bd = joined(has_b && has_d, x + 1, y, 0, 1);
  if (along_bc) {
    if (!joined(true, x + 1, y, -1, 1)) return triangles;
    if (ab && ac) triangles.corners[0] = kA | kB | kC;
    if (bd && cd) triangles.corners[1] = kB | kD | kC;
  } else {
    if (!joined(ad_possible, x, y, 1, 1)) return triangles;
    if (ab && bd) triangles.corners[0] = kA | kB | kD;
    if (cd && ac) triangles.corners[1] = kA | kD | kC;
  }
  return triangles;
}

bool IsWholeBlock(const Grid<double>& inverse_depth, int x, int y, const BreakRule& rule) {
  const int left = std::max(x, 0), right = std::min(x + 1, inverse_depth.width() - 1);
  const int top = std::max(y, 0), bottom = std::min(y + 1, inverse_depth.height() - 1);
  if (left < right && top < bottom) {
    const BlockTriangles triangles = TrianglesOfBlock(inverse_depth, left, top, rule);
    return triangles.corners[0] != 0 && triangles.corners[1] != 0;
  }
  if (!(inverse_depth(left, top) > 0 && inverse_depth(right, bottom) > 0)) return false;
  if (left == right && top == bottom) return true;
  return !EdgeBreaks(inverse_depth, left, top, right - left, bottom - top, rule);
}

bool IsMaskedBlock(const SampleGrid& samples, int x, int y) {
  const Grid<std::uint8_t>& masked = samples.masked;
  if (masked.empty()) return false;
  const int left = std::max(x, 0), right = std::min(x + 1, masked.width() - 1);
  const int top = std::max(y, 0), bottom = std::min(y + 1, masked.height() - 1);
  return masked(left, top) != 0 && masked(right, top) != 0 && masked(left, bottom) != 0 &&
         masked(right, bottom) != 0;
}

}  // namespace dtr
