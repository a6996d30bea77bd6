// calib/validation/photo_patterns.h -- internal to calib/validation: residuals that follow a
// pattern, held against the limits.
#pragma once
#include <vector>

#include "calib/validation/photos.h"

namespace dtr::calib {

/// Lens (radial, regional) and rolling shutter, in the residuals of a fresh solve with the layout
/// of its covariance. A pattern that is likely by chance counts as 0 px.
std::vector<Check> PatternChecks(const Adjusted& fresh, const BundleCovariance& layout,
                                 const BundleLimits& limits);

}  // namespace dtr::calib
