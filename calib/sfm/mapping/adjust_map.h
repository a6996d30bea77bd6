// calib/sfm/mapping/adjust_map.h -- internal to calib/sfm/mapping: the one place that adjusts.
#pragma once
#include "calib/bundle/bundle.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

/// Which of a lens's parameters may move; principal points never do.
enum class MapLens { kFixed, kFocalAndDistortion };

/// Whether the camera's model is one that can be adjusted here.
bool CanAdjust(const calib::LensCamera& lens);

struct AdjustMapOptions {
  std::vector<MapLens> lenses;  ///< per lens of the bundle
  /// Per lens, px: what EXIF or a vote told; no number: nothing. Observations that do not determine
  /// a focal length leave it there: it is drawn by 4 % (standard deviation), an observation by a
  /// third of the loss's scale.
  std::vector<std::vector<double>> known_focals_px = {};
  bool focals_hold = false;  ///< of all lenses: distortion alone moves
  double cauchy_px = 1;      ///< scale of Cauchy's loss
  int iterations = 30;
  double cost_tolerance = 1e-5;  ///< relative; an adjustment that another follows needs no more
  const Progress* progress = nullptr;
};

/// Poses, points and the lenses' free parameters that minimise Cauchy's loss of the reprojection
/// errors, from where `bundle` is. Observations whose point lies behind the camera do not take
/// part. False, and the bundle as it was, where there is nothing to adjust or no finite solution.
/// Requires lenses that CanAdjust. The same bits for any number of threads.
bool AdjustMap(const AdjustMapOptions& options, calib::Bundle* bundle);

}  // namespace dtr::sfm
