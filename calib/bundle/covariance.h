// calib/bundle/covariance.h -- what the observations leave uncertain about lenses and poses.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/bundle/adjust.h"

namespace dtr::calib {

/// Covariance of all lenses and poses (shifts of images are taken as known), points eliminated
/// (Schur complement, Triggs et al. 2000, sec. 6.1), in units of the bundle's world. Observations
/// of one point are not taken for independent (Liang and Zeger 1986; METHODS.md, 6). Unknowns, in
/// order: per lens its free parameters, per image a turn w (radians, along the camera's axes:
/// p_in_cam = exp(w) p_in_cam) and the centre's shift (world units).
///
/// The gauge: where the observations do not tell a common turn, shift or scale of everything, the
/// covariance is that of the free network: no camera is held, the sum of the variances is the least
/// that any gauge gives (inner constraints: Triggs et al. 2000, sec. 9.4). What does not depend on
/// the gauge, such as TransferCovariance below, comes out the same under any.
struct BundleCovariance {
  bool computed = false;   ///< false beyond kMaxUnknowns
  bool determined = true;  ///< false: besides the gauge, something is not determined
  int gauge_freedom = 0;   ///< 7 without priors, 6 where a distance is known, 0 with positions
  /// Largest over smallest singular value of the reduced J, columns of length 1, gauge left out:
  /// independent of any unit.
  double condition = 0;
  std::string weakest;  ///< the unknown with the largest part in the least determined combination
  double sigma_px = 0;  ///< of an observed coordinate, the scale of all; kPrecisionPx at least
  std::vector<std::vector<int>> free_params;  ///< per lens, indices into its params
  std::vector<int> lens_at, image_at;         ///< first unknown of each lens, image
  Eigen::MatrixXd matrix;

  /// 6x6: turn, then centre.
  Eigen::MatrixXd OfImage(int image) const;
  Eigen::MatrixXd OfLens(const Bundle& bundle, int lens) const;
};

/// Above, the matrix is not computed: 2000 unknowns (some 330 photos) take 32 MB and 20 s.
inline constexpr int kMaxUnknowns = 2000;

/// At a solution of Adjust; `options` as given to it. Deterministic.
BundleCovariance CovarianceOf(const Adjusted& adjusted, const AdjustOptions& options);

/// Variance matrix (px^2) of where a point lands in image `seen_in`, when images `a` and `b` place
/// it by its exact pixels in them: how far what is rendered from a and b lies off in a third view,
/// for the calibration's uncertainty alone. Independent of the gauge. NaN where the two rays do not
/// place the point or it has no pixel.
Eigen::Matrix2d TransferCovariance(const Bundle& bundle, const BundleCovariance& covariance,
                                   const Eigen::Vector3d& p_in_world, int a, int b, int seen_in);

}  // namespace dtr::calib
