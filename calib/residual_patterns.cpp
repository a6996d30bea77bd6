#include "calib/residual_patterns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/residuals.h"

namespace dtr::calib {

std::array<double, kRings> RingWeights(double radius_share) {
  std::array<double, kRings> weights{};
  const double place = kRings * radius_share;
  for (int ring = 0; ring < kRings; ++ring) {
    weights[static_cast<size_t>(ring)] = std::max(0.0, 1 - std::abs(place - (ring + 1)));
  }
  return weights;
}

int PatternRegionOf(const Eigen::Vector2d& pixel, int width_px, int height_px) {
  return CellOf(pixel.y(), height_px, kPatternRegions) * kPatternRegions +
         CellOf(pixel.x(), width_px, kPatternRegions);
}

Check PatternCheck(const char* name, const std::string& what, double p, double amplitude_px,
                   double min_p, double limit_px) {
  const bool chance = p >= min_p;
  return AtMost(name, chance ? 0 : amplitude_px, limit_px,
                fmt::format("{}: {:.4f} px RMS per coordinate; p = {:.2g}{}", what, amplitude_px, p,
                            chance ? ", what noise does" : ""));
}

}  // namespace dtr::calib
