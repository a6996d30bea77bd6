// calib/bundle/lens_params.h -- which number of a lens is which.
#pragma once
#include <string>
#include <vector>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// "f_px" or "fx_px", "fy_px", then "cx_px", "cy_px", then the coefficients, in CameraModel's
/// order.
std::vector<std::string> ParameterNames(CameraModel model);

}  // namespace dtr::calib
