// calib/bundle/parts.h -- internal to calib/bundle: parts of a bundle.
#pragma once
#include <vector>

#include "calib/bundle/bundle.h"

namespace dtr::calib {

/// The bundle of these images (by index), with the lenses that they use and the points that two of
/// them see; points keep their numbers.
Bundle OnlyImages(const Bundle& bundle, const std::vector<bool>& wanted);

/// Without images of fewer than `fewest` observations.
Bundle WithoutWeakImages(const Bundle& bundle, int fewest);

/// Unknowns of a bundle that is validated: its lenses' parameters, and per image a pose and the
/// three turns of a rolling shutter.
int ValidationUnknowns(const Bundle& bundle);

/// Every image of a bundle in one part of `max_unknowns` at most, images that see the same points
/// together: parts grow by the image that shares most points with what they hold. What is left over
/// is joined by images of other parts, so that no part is too small to be validated. Deterministic.
std::vector<Bundle> PartsOf(const Bundle& bundle, int max_unknowns);

}  // namespace dtr::calib
