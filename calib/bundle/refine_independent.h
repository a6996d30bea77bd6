// calib/bundle/refine_independent.h -- bundle adjustment of cameras that have not seen the
// observations.
#pragma once
#include "calib/bundle/refine.h"

namespace dtr::calib {

/// Refine (refine.h) of a model whose cameras were fitted to other data than its observations, such
/// as cameras of a file with points triangulated afterwards. As they have seen no observation, they
/// are a candidate like the others: the result is taken only if cameras adjusted to half of the
/// points predict the other half better than the cameras as given, beyond the bootstrap interval.
/// RefineReport::held_out_observations counts these points, given_px and adjusted_px are of them.
/// Priors and known lenses are Refine's.
Refined RefineIndependent(const SfmModel& model, const RefineOptions& options);

}  // namespace dtr::calib
