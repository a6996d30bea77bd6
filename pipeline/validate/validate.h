// pipeline/validate/validate.h -- the reprojection tests on everything a set knows.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "calib/validation/photos.h"
#include "calib/validation/reprojection.h"
#include "dtr/base/progress.h"
#include "dtr/eval/cross_depth.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

/// Tests every view of the set's first frame, held-out ones included unless they came without
/// observations (--holdout-strict, or cameras from a list). Views of `sparse` are indices
/// into that frame. Pixels need not be loaded.
calib::ValidationReport ReprojectionOfSet(const DtrSet& set, const SparseScene& sparse,
                                          const calib::ValidateLimits& limits);

struct SetLimits {
  calib::ValidateLimits reprojection;
  calib::BundleLimits photos;
  /// Depth of one view through its neighbours and back, median of all pixels (eval/cross_depth.h).
  /// The worst view may have twice as much: fewer pixels, seen from farther aside.
  double max_cross_px = 1;
  double memory_gb = 1;  ///< 1e9 bytes: of depth maps held for that at a time
};

/// The tests of reprojection, joined by those of what is below and of the set's rig.
struct SetValidation : calib::ValidationReport {
  std::optional<eval::CrossDepthReport> cross_depth;  ///< where two views or more have depth
  calib::PhotosValidation adjustment;                 ///< by a fresh bundle adjustment
};

/// JSON object: result and conclusion (calib/validation/conclusion.h), that of
/// calib::ToJson(calib::ValidationReport), `adjustment`, and `cross_depth`
/// {views[], all} where there is such.
std::string ToJson(const SetValidation& report);

/// ReprojectionOfSet, and then the set is validated by a fresh bundle adjustment
/// (calib/validation/photos.h), whose tests and figures join the report: some seconds. A set that
/// was built with a rig must still stand as that does (RigPlaces, set_rig.h). Where views have
/// depth, it is carried into the neighbours and back; their maps are read from `folder`, as many at
/// a time as memory_gb holds (one with its neighbours where it holds less).
SetValidation ValidateSet(const std::filesystem::path& folder, const DtrSet& set,
                          const SparseScene& sparse, const SetLimits& limits, Progress& progress);

/// That as a page. `conclusion`, the tests; a table of the views; for every size of image, all
/// views together: residual vectors, coverage, and how uncertain the image is where the fresh
/// bundle adjustment gave it; and the worst views, drawn over their images, read from `folder` one
/// at a time. `set` and `report` belong together. Deterministic.
std::string ValidationPage(const std::filesystem::path& folder, const DtrSet& set,
                           const SetValidation& report, const std::string& title,
                           const std::string& conclusion);

}  // namespace dtr::pipeline
