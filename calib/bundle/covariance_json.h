// calib/bundle/covariance_json.h -- what is uncertain about lenses and poses, for programs.
#pragma once
#include <string>

#include "calib/bundle/covariance.h"

namespace dtr::calib {

/// JSON object: sigma_px, condition, gauge_freedom, determined, lenses[].{names,matrix} with the
/// unknowns of free parameters by name, cameras[].{name,matrix} with 6 rows of 6: turn w (radians,
/// p_in_cam = exp(w) p_in_cam), then the centre (world units), in the gauge of the free network
/// (BundleCovariance). Without matrices where the covariance is not determined or not computed.
std::string ToJson(const Adjusted& adjusted, const BundleCovariance& covariance);

}  // namespace dtr::calib
