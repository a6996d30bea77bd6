// calib/precision.h -- floors under everything that is measured in units of the pixels' noise.
#pragma once
#include <algorithm>

namespace dtr::calib {

/// No pixel's coordinate is taken as better known than this, standard deviation: float holds those
/// of 4096 px and more to 5e-4 px, and text files often have three decimals. Whatever is measured
/// in units of noise uses at least this, as noise below it is rounding, of which no ratio means
/// anything.
inline constexpr double kPrecisionPx = 1e-3;

/// Standard deviation that outliers are told by is at least this, however exact the other
/// observations are: some photos may be exact and others rounded, and what fits to 0.1 px (five
/// of it) misleads nobody.
inline constexpr double kMinOutlierSigmaPx = 0.02;

/// What covariances for unit noise are multiplied by, where residuals say that noise is `sigma_px`.
inline double VarianceOf(double sigma_px) {
  const double known_px = std::max(sigma_px, kPrecisionPx);
  return known_px * known_px;
}

}  // namespace dtr::calib
