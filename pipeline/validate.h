// pipeline/validate.h -- the reprojection tests on everything a set knows.
#pragma once
#include <filesystem>

#include "calib/validation/photos.h"
#include "calib/validation/reprojection.h"
#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

/// Tests every view of the set's first frame, held-out ones included unless they came without
/// observations (--holdout-strict, or cameras from a list). Views of `sparse` are indices
/// into that frame. Pixels need not be loaded.
calib::ValidationReport ReprojectionOfSet(const DtrSet& set, const SparseScene& sparse,
                                          const calib::ValidateLimits& limits, int threads);

struct SetLimits {
  calib::ValidateLimits reprojection;
  calib::BundleLimits photos;
  /// Depth of one view through its neighbours and back, median of all pixels (eval/cross_depth.h).
  /// The worst view may have twice as much: fewer pixels, seen from farther aside.
  double max_cross_px = 1;
  double memory_gb = 1;  ///< 1e9 bytes: of depth maps held for that at a time
};

/// The same, and then the set is evaluated by a fresh bundle adjustment
/// (calib/validation/photos.h), whose tests and figures join the report: some seconds. A set that
/// was built with a rig must still stand as that does (RigPlaces, set_rig.h). Where views have
/// depth, it is carried into the neighbours and back; their maps are read from `folder`, as many at
/// a time as memory_gb holds (one with its neighbours where it holds less).
calib::ValidationReport ValidateSet(const std::filesystem::path& folder, const DtrSet& set,
                                    const SparseScene& sparse, const SetLimits& limits, int threads,
                                    Progress& progress);

}  // namespace dtr::pipeline
