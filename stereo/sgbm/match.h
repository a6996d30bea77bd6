// stereo/sgbm/match.h -- semi-global matching of one rectified pair, brought back to the reference.
#pragma once
#include <Eigen/Core>

#include "stereo/sgbm/grey_image.h"
#include "stereo/sgbm/rectify.h"

namespace dtr::stereo {

/// What one sweep over one pair says about the reference view.
struct PairDepth {
  int pair = 0;               ///< sweeps of the same pair are no independent witnesses
  Grid<float> inverse_depth;  ///< 1/z on the reference grid, NaN where nothing matched
  /// Change of 1/z per pixel of disparity at a reference pixel: the dot product with its ray.
  Eigen::Vector3d step_from_ray = Eigen::Vector3d::Zero();

  double StepAt(const Eigen::Vector3d& ray) const { return step_from_ray.dot(ray); }
};

/// Disparities of the rectified pair by OpenCV's StereoSGBM (Hirschmueller, PAMI 2008, with the
/// costs of Birchfield and Tomasi), left-right checked, in 1/16 px, resampled at the pixel centres
/// of `grid`, the reference's camera or a resized one. The neighbour's image is sheared by the
/// sweep's plane first. Values may lie outside the searched depth range (also <= 0: beyond
/// infinity). Single-threaded and deterministic.
PairDepth MatchPair(const GreyImage& reference, const GreyImage& neighbour,
                    const RectifiedPair& pair, const Sweep& sweep, const PinholeCamera& grid);

}  // namespace dtr::stereo
