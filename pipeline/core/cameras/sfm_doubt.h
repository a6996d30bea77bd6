// pipeline/core/cameras/sfm_doubt.h -- cameras that structure from motion was not sure of.
#pragma once
#include <optional>

#include "dtr/types/check.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// `sfm_doubts`: fails with the reason that the set's provenance has; empty for sets whose cameras
/// are not in doubt. The doubt is of the arrangement as a whole, which the points of a wrong one do
/// not contradict. Throws Error where the provenance is none.
std::optional<Check> SfmDoubtCheck(const DtrSet& set);

}  // namespace dtr::pipeline
