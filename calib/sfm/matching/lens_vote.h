// calib/sfm/matching/lens_vote.h -- focal length and radial distortion that many pairs agree on.
#pragma once
#include <optional>
#include <vector>

#include "calib/sfm/matching/epipolar.h"
#include "dtr/base/progress.h"

namespace dtr::sfm::matching {

/// Matches of a pair taken with one lens: offsets from the principal point, in long sides of the
/// photo; and the fundamental matrix they were chosen with, for these units, of a fisheye for the
/// plane z = 1.
struct VotePair {
  PointPairs points;
  Eigen::Matrix3d fundamental = Eigen::Matrix3d::Zero();
  int photo_a = 0, photo_b = 0;  ///< any numbers: errors of pairs that share one go together
};

/// A lens of one focal length (long sides) and x_d = x (1 + k1 |x|^2), where x is the point on the
/// plane z = 1, of a fisheye its direction times the angle.
struct VoteLens {
  double focal = 1, k1 = 0;
  bool fisheye = false;
  Eigen::Vector2d centre =
      Eigen::Vector2d::Zero();  ///< the principal point, from where it is taken
};

struct VoteOptions {
  double prior_focal = 1.2;     ///< long sides; a weak prior on its logarithm
  bool focal_is_fixed = false;  ///< only k1 is voted on
  bool k1_is_fixed = false;     ///< k1 stays 0: the camera's model has none
  bool fisheye = false;         ///< the lens is one
  const Progress* progress = nullptr;
};

struct VoteResult {
  VoteLens lens;
  /// Standard deviation of log(focal): the larger of what the matches' spread and what leaving out
  /// one photo after the other tells.
  double log_focal_deviation = 0;
  double cost = 0;  ///< sum of RobustCost over all matches
};

/// The lens for which essential matrices explain the matches best: a grid over log(focal) and k1,
/// poses refined at each, then Levenberg-Marquardt over lens and poses together (poses eliminated
/// by their Schur complement). Sampson distances in pixels of the distorted photo. Empty without
/// pairs.
std::optional<VoteResult> VoteOnLens(const std::vector<VotePair>& pairs,
                                     const VoteOptions& options);

/// The point of the plane z = 1 seen at p (offset in long sides); empty beyond the distortion's
/// turning point, and of a fisheye 80 degrees off its axis. `magnification`: how much longer
/// distances are there than at the centre (geometric mean of the radial and the tangential), times
/// 1 / focal.
std::optional<Eigen::Vector2d> Unbent(const VoteLens& lens, const Eigen::Vector2d& p,
                                      double* magnification);

}  // namespace dtr::sfm::matching
