// cli/pipeline/validate_set.h -- the reprojection tests on everything a set knows.
#pragma once
#include "calib/bundle/judge.h"
#include "calib/validate.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

/// Tests every view of the set's first frame, held-out ones included unless they came without
/// observations (--holdout-strict, or cameras from a list). Views of `sparse` are indices
/// into that frame. Pixels need not be loaded.
calib::ValidationReport ReprojectionOfSet(const DtrSet& set, const SparseScene& sparse,
                                          const calib::ValidateLimits& limits, int threads);

/// The same, and then the set is judged by a fresh bundle adjustment (calib/bundle/judge.h), whose
/// tests and figures join the report: some seconds. A set that was built with a rig must still
/// stand as that does (RigPlaces, set_rig.h).
calib::ValidationReport ValidateSet(const DtrSet& set, const SparseScene& sparse,
                                    const calib::ValidateLimits& limits, int threads,
                                    const calib::BundleLimits& judge_limits = {});

}  // namespace dtr::pipeline
