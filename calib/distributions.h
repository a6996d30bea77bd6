// calib/distributions.h -- how often chance alone gives as much.
#pragma once

namespace dtr::calib {

/// P(X >= x) for chi-squared with `freedom` degrees; 1 for x <= 0. Relative error below 1e-10 where
/// the result exceeds 1e-300. Requires freedom > 0.
double ChiSquaredSurvival(double x, double freedom);

/// P(X >= x) for Fisher's F with these degrees of freedom; 1 for x <= 0. Requires both > 0.
double FisherSurvival(double x, double freedom_above, double freedom_below);

/// Standard deviation of a variance that rounding may have left below 0. Not a number stays so:
/// std::max(0.0, NaN) is 0, as if all were known.
double RootOfVariance(double variance);

/// The x with ChiSquaredSurvival(x, freedom) = p; requires 0 < p < 1.
double ChiSquaredLimit(double p, double freedom);

}  // namespace dtr::calib
