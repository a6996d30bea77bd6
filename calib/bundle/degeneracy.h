// calib/bundle/degeneracy.h -- what views do not suffice for.
#pragma once
#include <string>
#include <vector>

#include "calib/bundle/covariance.h"

namespace dtr::calib {

/// Standard deviation of a focal length over itself, above which it counts as undetermined.
inline constexpr double kMaxFocalShare = 0.1;

/// A way in which the views do not suffice, by name.
struct Degeneracy {
  std::string name;      ///< "pure_rotation", "collinear_centres", ...
  std::string detail;    ///< what was found, in numbers
  bool harmful = false;  ///< something is undetermined for it; else it is only worth knowing
};

/// Degeneracies of a solution (degeneracy.cpp says how each is recognised). `covariance` may be one
/// that is not determined.
std::vector<Degeneracy> FindDegeneracies(const Adjusted& adjusted,
                                         const BundleCovariance& covariance,
                                         double max_focal_share);

}  // namespace dtr::calib
