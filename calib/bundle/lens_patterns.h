// calib/bundle/lens_patterns.h -- internal to calib/bundle: residuals that a lens model cannot
// follow.
#pragma once
#include "calib/bundle/wider_fit.h"

namespace dtr::calib {

/// A pattern of every lens by itself, over all its images.
struct LensPatternTest {
  WiderFit fit;
  int lenses_left_out =
      0;  ///< those of fewest observations, where more unknowns than can be tested
};

/// Along the radius from the principal point, as a function of the radius (kRings).
LensPatternTest TestRadialPattern(const Adjusted& adjusted, const BundleCovariance& layout);
/// A mean residual vector in each region of the image (kPatternRegions).
LensPatternTest TestRegionalPattern(const Adjusted& adjusted, const BundleCovariance& layout);

}  // namespace dtr::calib
