// calib/similarity.h -- from one gauge to another.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

#include "dtr/types/pose.h"

namespace dtr::calib {

/// p_in_b = scale * (rotation * p_in_a) + translation: what two reconstructions of the same scene
/// may differ by.
struct Similarity {
  double scale = 1;                                              ///< > 0
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit length
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();         ///< in units of b

  Eigen::Vector3d operator*(const Eigen::Vector3d& p_in_a) const {
    return scale * (rotation * p_in_a) + translation;
  }
  Similarity Inverse() const;
  /// The camera of `cam_from_a` in world b. Lengths in its frame are then in units of b: a depth is
  /// `scale` times what it was.
  Pose CamFromB(const Pose& cam_from_a) const;
};

/// Requires a point.
Eigen::Vector3d MeanOf(std::span<const Eigen::Vector3d> points);

/// The similarity b_from_a with the smallest sum of squared distances |b_from_a * a_i - b_i|^2
/// (Umeyama 1991, eq. 40-42). It needs three points that are not on one line; for camera centres
/// that is a path with a bend. Throws Error when the numbers of points differ, are below three, a
/// coordinate is not finite, or either set lies in a point or on a line: the turn about that line
/// is then unknown, and a guess would pass for a calibration.
Similarity AlignPoints(std::span<const Eigen::Vector3d> points_in_a,
                       std::span<const Eigen::Vector3d> points_in_b);

/// The same where the scale is known (> 0): only turn and shift are looked for.
Similarity AlignPointsAtScale(std::span<const Eigen::Vector3d> points_in_a,
                              std::span<const Eigen::Vector3d> points_in_b, double b_per_a);

/// The turn and shift near none at all (scale 1) with the smallest sum of squared differences
/// b_from_a * a_i - b_i, each coordinate in units of sigmas_i > 0; nothing where none is nearer.
/// Requires equal numbers, and that the two sets are nearly there.
Similarity TurnAndShift(std::span<const Eigen::Vector3d> points_in_a,
                        std::span<const Eigen::Vector3d> points_in_b,
                        std::span<const Eigen::Vector3d> sigmas);

/// Root mean square of the distances |b_from_a * a_i - b_i|, in units of b. Requires equal numbers.
double AlignmentRms(const Similarity& b_from_a, std::span<const Eigen::Vector3d> points_in_a,
                    std::span<const Eigen::Vector3d> points_in_b);

}  // namespace dtr::calib
