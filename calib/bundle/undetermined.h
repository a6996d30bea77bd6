// calib/bundle/undetermined.h -- which terms of lenses a solve freed and does not determine.
#pragma once
#include <string>

#include "calib/bundle/adjust.h"
#include "calib/bundle/covariance.h"

namespace dtr::calib {

/// Of a solution with its covariance, both with `options`, the first lens with a term that was
/// freed and stays undetermined, as a clause: "principal point of 0002.jpg, known to 4.8 px at
/// best". Empty: there is none. A principal point must be known to kOpenShare of what is known of
/// all cameras, distortion so that the image's corner is known to 2 % of its distance from the
/// principal point.
std::string UndeterminedTerm(const Adjusted& adjusted, const BundleCovariance& covariance,
                             const AdjustOptions& options);

/// "0002.jpg" of a lens of one image, else "camera 3".
std::string NameOfLens(const Bundle& bundle, int lens);

}  // namespace dtr::calib
