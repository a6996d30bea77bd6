// calib/bundle/plain/place_points.h -- internal to calib/bundle/plain: points of known cameras.
#pragma once
#include "calib/bundle/plain/minimise.h"

namespace dtr::calib::plain {

/// Places every point by itself, from where `x` has it. A point that has an observation without a
/// pixel at the start stays.
MinimiseResult PlacePoints(const Problem& problem, const MinimiseOptions& options, Unknowns& x);

}  // namespace dtr::calib::plain
