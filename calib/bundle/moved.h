// calib/bundle/moved.h -- internal to calib/bundle: how far images move from one set of cameras
// to another.
#pragma once
#include <vector>

#include "calib/bundle/adjust.h"

namespace dtr::calib {

/// Per image, RMS over the points that its used observations show of how far other lenses and poses
/// draw them from where the solve does, px. NaN for an image that shows none. Points that outliers
/// made say nothing of cameras. Requires the images of `solved` in `other_cameras`, in order.
std::vector<double> MovedPx(const Adjusted& solved, const Bundle& other_cameras);

/// The same where the other cameras' world is turned, scaled and moved as a whole, to first order,
/// so that the sum over the images is least (reweighted least squares). A gauge that is near to all
/// poses would carry the fault of one camera to the others, and take it off its own.
std::vector<double> MovedPxInNearestWorld(const Adjusted& solved, const Bundle& other_cameras);

}  // namespace dtr::calib
