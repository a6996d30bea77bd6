// calib/bundle/plain/plain_adjust.h -- bundle adjustment with derivatives and elimination by hand,
// for the plain problem: camera models up to OPENCV and radial fisheyes, no known positions or
// distances.
#pragma once
#include <vector>

#include "calib/bundle/bundle.h"
#include "dtr/base/progress.h"

namespace dtr::calib {

/// Whether the solver by hand knows a camera's model: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL,
/// RADIAL, OPENCV.
bool IsPlain(const LensCamera& lens);

struct PlainOptions {
  /// What of the intrinsics moves, of every lens that `fixed_lenses` does not name.
  bool free_focal = true, free_distortion = true, free_principal_point = false;
  std::vector<bool> fixed_lenses;  ///< per lens; empty: none
  bool free_poses = true;
  std::vector<bool> fixed_images;  ///< per image: poses that stay though others move; empty: none
  /// Above 0: every image's own principal point moves, drawn to its lens's by this standard
  /// deviation, px, where an observation's coordinate has one of 1 px. Requires free poses.
  double principal_point_sigma_px = 0;
  /// Per lens, px: what is known of its one or two focal lengths; no number: nothing. Where they
  /// are free they are drawn there by a standard deviation of `focal_sigma_share` of the value,
  /// where an observation's coordinate has one of 1 px. Empty: nothing is known of any.
  std::vector<std::vector<double>> known_focals_px;
  double focal_sigma_share = 0.04;
  double cauchy_px = 0;          ///< scale of Cauchy's loss; 0: least squares
  double cost_tolerance = 1e-9;  ///< converged where no step promises more, relative to the cost
  int max_iterations = 50;
  const Progress* progress = nullptr;  ///< asked every iteration; Interrupted is thrown
};

struct PlainResult {
  /// Half the sum over the used observations of the loss of |predicted - observed|^2, px^2.
  double start_cost = 0, cost = 0;
  int iterations = 0;
  bool converged = false;
};

/// Minimises the cost from `bundle`, in place: Levenberg-Marquardt on the unknowns of
/// observation_cost.h (turns, centres, directions with inverse distances), analytic derivatives,
/// points eliminated by their 3 x 3 blocks, Cholesky of what is left: dense, or sparse where few
/// images see the same points. `used`: per observation; empty: all. Observations without a pixel at
/// the start do not count, whatever `used` says. The gauge is held by the damping alone: the world
/// as a whole hardly moves, but is free to; with two fixed images nothing is.
/// The same bits for any number of threads. Throws Error as CheckBundle does, on lenses that are
/// not plain, on lists of another length than what they belong to, and where no observation has a
/// pixel.
PlainResult AdjustPlain(const PlainOptions& options, const std::vector<bool>& used, Bundle& bundle);

}  // namespace dtr::calib
