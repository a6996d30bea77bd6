// calib/sfm/mapping/rotation_averaging.h -- internal to calib/sfm/mapping: rotations of all images
// out of those of pairs.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/sfm/mapping/pair_poses.h"

namespace dtr::sfm {

/// How far a pair's rotation may err beyond its covariance, standard deviation in rad: the cameras'
/// intrinsics are priors, and a wrong focal length turns rotations alike.
inline constexpr double kRotationFloorRad = 0.02;

/// Per pair, in [0, 1]: how many of its triplets close. A triplet closes when its cycle of three
/// rotations is the identity within four standard deviations. At most 40 triplets per pair are
/// looked at. Pairs without triplets have 0.5.
std::vector<double> TripletSupport(int images, std::span<const RelativeRotation> pairs);

/// Takes the poses with which the most triplets close. Right poses close their triplets, wrong ones
/// those of the same mistake alone. Two kinds of search, of which the first with the most counts:
/// from the poses as they are, a pair at a time; and of all pairs at once, from both poses
/// (relaxation). Where all pairs that join two groups of images have the wrong pose, no single one
/// of them closes more triplets.
void ChooseTwins(int images, std::vector<RelativeRotation>* pairs);

/// What a pose of images a and b disagrees by with rotations in one world, in standard deviations.
double MisfitOf(const MatchedPose& pose, const Eigen::Matrix3d& a_from_world,
                const Eigen::Matrix3d& b_from_world);

/// Rotations in one world, and what pairs disagree by.
struct AveragedRotations {
  std::vector<Eigen::Matrix3d> cam_from_world;  ///< per image; identity where no pair has it
  std::vector<double> misfit;                   ///< per pair: residual in standard deviations
  std::vector<double> angle_rad;                ///< per pair: residual
};

/// Robust averaging: a maximum spanning tree of matches times `support`, then iteratively
/// reweighted least squares in the tangent space, first with L1 weights, then Geman and McClure's
/// (Chatterjee & Govindu 2013), each residual in units of its own covariance with the floor above.
/// Sparse Cholesky. Requires that `pairs` connect all images that they name.
AveragedRotations AverageRotations(int images, std::span<const RelativeRotation> pairs,
                                   std::span<const double> support);

}  // namespace dtr::sfm
