#include "calib/models/radial_bend.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/models/lens_formula.h"

namespace dtr::calib {
namespace {

constexpr double kStep = 0.002;      // of |q|
constexpr double kFarthestTan = 20;  // of |q| of a perspective model: 87 degrees
constexpr double kFarthestRad = 100 * std::numbers::pi / 180;
constexpr double kMargin = 1.02;     // of the farthest corner's distance: what undistortion reads
constexpr double kFurtherTerms = 2;  // of the change by the square law
constexpr double kFloor = 0.1;       // 10 % of scale: lenses that hardly change it may begin to

// |d| at this |q|, tangential terms left out.
double RadiusAt(const LensFormula<double>& lens, double q) {
  const double s = q * q;
  return q * lens.RadialNumerator(s) / lens.RadialDenominator(s);
}

Eigen::Vector2d InFocalLengths(const LensFormula<double>& lens, const Eigen::Vector2d& pixel) {
  return {(pixel.x() - lens.cx_px) / lens.fx_px, (pixel.y() - lens.cy_px) / lens.fy_px};
}

double BorderRadius(const LensCamera& camera, const LensFormula<double>& lens) {
  double border = 0;
  for (const double x : {0.0, static_cast<double>(camera.width_px)}) {
    for (const double y : {0.0, static_cast<double>(camera.height_px)}) {
      border = std::max(border, InFocalLengths(lens, {x, y}).norm());
    }
  }
  return border;
}

}  // namespace

double OutermostPx(const LensCamera& camera, std::span<const BoardCorner> corners,
                   std::span<const int> outliers) {
  const auto lens = FormulaOf(camera.model, camera.params.data());
  double outermost = 0;
  for (const BoardCorner& corner : corners) {
    if (std::binary_search(outliers.begin(), outliers.end(), corner.id)) continue;
    outermost = std::max(outermost, InFocalLengths(lens, corner.pixel).norm());
  }
  return outermost * 0.5 * (lens.fx_px + lens.fy_px);
}

RadialBend RadialBendOf(const LensCamera& camera, double seen_px) {
  const auto lens = FormulaOf(camera.model, camera.params.data());
  const double focal = 0.5 * (lens.fx_px + lens.fy_px);
  const double seen = seen_px / focal, border = BorderRadius(camera, lens) * kMargin;
  RadialBend bend;
  bend.seen_px = seen_px;
  bend.border_px = border * focal;
  const double last = lens.fisheye ? kFarthestRad : kFarthestTan;
  double seen_q = 0, radius = 0;
  for (double q = kStep; q < last; q += kStep) {
    const double next = RadiusAt(lens, q);
    const double scale = (next - radius) / kStep;
    if (!(scale > 0)) {
      bend.folds = true;
      return bend;
    }
    radius = next;
    const double change = std::abs(std::log(scale));
    if (radius <= seen) {
      bend.seen_change = std::max(bend.seen_change, change);
      seen_q = q;
    }
    bend.beyond_change = std::max(bend.beyond_change, change);
    const double growth = q / std::max(seen_q, kStep);
    bend.allowed = kFloor + kFurtherTerms * growth * growth * bend.seen_change;
    if (radius > border) break;
  }
  return bend;
}

}  // namespace dtr::calib
