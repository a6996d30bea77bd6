// cli/pipeline/validate_set.h -- the reprojection tests on everything a set knows.
#pragma once
#include "calib/validate.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

/// Tests every view of the set's first frame, held-out ones included. Views of `sparse` are indices
/// into that frame. Pixels need not be loaded.
calib::ValidationReport ValidateSet(const DtrSet& set, const SparseScene& sparse,
                                    const calib::ValidateLimits& limits, int threads);

}  // namespace dtr::pipeline
