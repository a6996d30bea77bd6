#include "dtr/render/closed_cells.h"

#include <algorithm>
#include <cmath>

namespace dtr {
namespace {

double InverseDepthAt(const Grid<double>& grid, int x, int y) {
  return grid.Contains(x, y) ? grid(x, y) : 0;
}

/// The corner of a single triangle that does not lie on the block's diagonal.
std::uint8_t ApexOf(std::uint8_t corners) {
  switch (corners) {
    case kA | kB | kC:
      return kA;
    case kB | kC | kD:
      return kD;
    case kA | kB | kD:
      return kB;
    default:
      return kC;
  }
}

}  // namespace

double LocalSlope(const Grid<double>& inverse_depth, int x, int y, int dx, int dy,
                  const BreakRule& rule) {
  const double here = inverse_depth(x, y);
  const double after = InverseDepthAt(inverse_depth, x + dx, y + dy);
  const double before = InverseDepthAt(inverse_depth, x - dx, y - dy);
  double slope = 0;
  bool found = false;
  if (after > 0 && !EdgeBreaks(inverse_depth, x, y, dx, dy, rule)) {
    slope = after - here;
    found = true;
  }
  if (before > 0 && !EdgeBreaks(inverse_depth, x - dx, y - dy, dx, dy, rule)) {
    const double backward = here - before;
    if (!found || std::abs(backward) < std::abs(slope)) slope = backward;
  }
  return slope;
}

std::uint8_t OpenCorners(const BlockTriangles& block) {
  constexpr std::uint8_t kAll = kA | kB | kC | kD;
  if (block.corners[0] != 0 && block.corners[1] != 0) return 0;
  const std::uint8_t drawn = block.corners[0] | block.corners[1];
  return drawn == 0 ? kAll : static_cast<std::uint8_t>(kAll & ~ApexOf(drawn));
}

std::array<SurfacePoint, 4> QuarterCell(const SampleGrid& samples, int x, int y, int corner,
                                        const BreakRule& rule) {
  const Grid<double>& inverse_depth = samples.inverse_depth;
  const double here = inverse_depth(x, y);
  const double slope_x = LocalSlope(inverse_depth, x, y, 1, 0, rule);
  const double slope_y = LocalSlope(inverse_depth, x, y, 0, 1, rule);
  const auto at = [&](double dx, double dy) -> SurfacePoint {
    // Half a sample cannot bring a surface to infinity; noise on a single sample could.
    return {samples.Centre(x) + dx * samples.step, samples.Centre(y) + dy * samples.step,
            std::max(here + dx * slope_x + dy * slope_y, 0.5 * here)};
  };
  const double left = (corner & 1) ? -0.5 : 0, right = (corner & 1) ? 0 : 0.5;
  const double top = (corner >> 1) ? -0.5 : 0, bottom = (corner >> 1) ? 0 : 0.5;
  return {at(left, top), at(right, top), at(left, bottom), at(right, bottom)};
}

}  // namespace dtr
