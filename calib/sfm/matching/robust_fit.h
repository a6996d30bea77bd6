// calib/sfm/matching/robust_fit.h -- geometry of a pair whose matches are partly wrong.
#pragma once
#include <cstdint>
#include <optional>

#include "calib/sfm/matching/epipolar.h"

namespace dtr::sfm::matching {

/// A matrix with x_b^T m x_a = 0 and which of the matches agree with it.
struct RobustFit {
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  RelativePose pose;  ///< of FitEssential; m is its essential matrix
  std::vector<int> inliers;
};

/// Essential matrix of points on z = 1, the most trusted first: five-point RANSAC (samples from the
/// first points at first: Chum and Matas, "PROSAC", CVPR 2005), cost of truncated squares (Torr and
/// Zisserman, "MLESAC", 2000), and refinement of every new best (Chum, Matas, Kittler, DAGM 2003).
/// `threshold`: Sampson distance, in the points' unit. Deterministic in `seed`. Empty: under 5
/// points, or no model.
std::optional<RobustFit> FitEssential(const PointPairs& points, double threshold,
                                      std::uint64_t seed);

/// Fundamental matrix, the same with seven points.
std::optional<RobustFit> FitFundamental(const PointPairs& points, double threshold,
                                        std::uint64_t seed);

/// Homography b ~ m a, the same with four points; distances are measured in b.
/// Meant for those that explain most of the points: it gives up early.
std::optional<RobustFit> FitHomography(const PointPairs& points, double threshold,
                                       std::uint64_t seed);

/// Median distance in b of the points from the least-squares homography: 0 without parallax.
double MedianHomographyDistance(const PointPairs& points);

/// Points within the threshold of an epipolar geometry.
std::vector<int> EpipolarInliers(const Eigen::Matrix3d& m, const PointPairs& points,
                                 double threshold);

/// How many of `count` wrong matches agree with the best of the geometries that RANSAC tries, at
/// most: a pair with no more coarse inliers shows nothing. `band_share`: share of the photo within
/// the threshold of a line.
int ChanceInliers(size_t count, double band_share);

}  // namespace dtr::sfm::matching
