// dtr/exposure/estimate_gains.h -- how differently the photos of a scene were exposed.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "dtr/types/camera.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"
#include "dtr/types/view.h"

namespace dtr {

/// A view in little: what EstimateGains asks of it.
struct SmallView {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};  ///< of the grids
  Pose cam_from_world;
  /// Linear light in (0, 1), RGB, averages over blocks of the photo; 0 where a pixel of the block
  /// is masked, nearly black or nearly white.
  Grid<float> light;
  Grid<float> inverse_depth;  ///< 1 / plane z; 0: none
};

/// Of a loaded view, its longer side at most 320 pixels.
SmallView ShrinkForGains(const View& view);

/// The gain of each view (View::gain): the exposure per channel that brings it to the mean of all,
/// which is the mean of logarithms. Two views that measured a surface alike differ by the exposure
/// that most patches there agree on, of those between what the two show where that is neither black
/// nor white; all pairs together are solved in logarithms under Cauchy's loss, damped, so that long
/// chains of photos do not drift and views without a partner keep 1. `partners`: of each view,
/// indices of others that show the same. All are exactly 1 where none is 2 % or more from it, since
/// errors of that size do not show. Deterministic for any number of threads.
std::vector<Eigen::Vector3d> EstimateGains(std::span<const SmallView> views,
                                           std::span<const std::vector<int>> partners);

}  // namespace dtr
