// calib/sfm/features/refine_extremum.h -- position of an extremum between pixels and scales.
#pragma once
#include <optional>

#include "calib/sfm/features/scale_space.h"

namespace dtr::sfm {

/// Steps of a pixel in each direction before the last fit, and rows around an extremum that the
/// fit may read.
constexpr int kRefineSteps = 5, kRefineReach = kRefineSteps + 1;

/// The extremum near column x and row y of the difference between the levels `scale` and
/// `scale` + 1, by quadratic fits to 3 x 3 x 3 values (Brown and Lowe, BMVC 2002) that move to the
/// next pixel as long as the extremum lies there. Empty where its contrast is too low, it lies on
/// an edge, or the fit leads away.
std::optional<Extremum> RefineExtremum(const Octave& octave, int scale, int x, int y,
                                       const ExtremumLimits& limits);

}  // namespace dtr::sfm
