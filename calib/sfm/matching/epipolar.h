// calib/sfm/matching/epipolar.h -- two-view geometry: minimal solvers, linear fits, refinement.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace dtr::sfm::matching {

/// Matched points of two images, of the same number, on the plane z = 1 of each camera (or any
/// affine image of it, for fundamental matrices).
struct PointPairs {
  std::vector<Eigen::Vector2d> a, b;
  size_t size() const { return a.size(); }
  void Add(const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    a.push_back(p);
    b.push_back(q);
  }
};

/// Rotation and direction (length 1) from camera a to camera b: X_b = R X_a + t.
struct RelativePose {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::UnitX();
  Eigen::Matrix3d Essential() const;
};

/// Squared Sampson distance of a match to x_b^T m x_a = 0 (Hartley & Zisserman, eq. 11.9); infinite
/// where m has no line.
double SampsonSquared(const Eigen::Matrix3d& m, const Eigen::Vector2d& a, const Eigen::Vector2d& b);

/// Up to 10 essential matrices of five matches (Stewenius, Engels, Nister, "Recent developments on
/// direct relative orientation", 2006). Indices into `points`.
std::vector<Eigen::Matrix3d> EssentialFromFive(const PointPairs& points, std::span<const int> five);

/// Up to 3 fundamental matrices of seven matches (Hartley & Zisserman, section 11.1.2).
std::vector<Eigen::Matrix3d> FundamentalFromSeven(const PointPairs& points,
                                                  std::span<const int> seven);

/// Fundamental matrix of 8 matches or more by least squares with weights (Hartley's normalised
/// 8-point algorithm, PAMI 1997). Empty when points are degenerate or too few.
std::optional<Eigen::Matrix3d> FundamentalFromMany(const PointPairs& points,
                                                   std::span<const double> weights);

/// The pose of an essential matrix with the most of `points` in front of both cameras. Points whose
/// weight is 0 do not count; empty weights: all 1.
RelativePose PoseFromEssential(const Eigen::Matrix3d& essential, const PointPairs& points,
                               std::span<const double> weights);

/// Depths of a match along its rays (x, y, 1) where they pass closest; empty for parallel rays.
std::optional<Eigen::Vector2d> DepthsOf(const RelativePose& pose, const Eigen::Vector2d& a,
                                        const Eigen::Vector2d& b);

/// Robust cost of a match: Geman and McClure's s^2 / (1 + s^2), s = residual / scale.
inline double RobustCost(double squared_over_scale) {
  return squared_over_scale / (1 + squared_over_scale);
}

/// Signed Sampson distance and its derivatives by the pose's five parameters (rotation from the
/// left, two directions across t).
using PoseRow = Eigen::Matrix<double, 1, 5>;

/// What derivatives by a pose need, once per pose.
class PoseDerivatives {
 public:
  explicit PoseDerivatives(const RelativePose& pose);
  /// Signed Sampson distance of a match.
  double Residual(const Eigen::Vector2d& a, const Eigen::Vector2d& b, PoseRow* row) const;
  /// The pose moved by a step.
  RelativePose Moved(const Eigen::Matrix<double, 5, 1>& step) const;

 private:
  RelativePose pose_;
  Eigen::Matrix<double, 3, 2> across_;
  Eigen::Matrix3d e_, de_[5];
};

/// Sum of the robust costs of all matches.
double PoseCost(const RelativePose& pose, const PointPairs& points, double scale);

/// Minimises PoseCost by iteratively reweighted Levenberg-Marquardt steps from a start.
RelativePose RefinePose(RelativePose pose, const PointPairs& points, double scale, int iterations);

}  // namespace dtr::sfm::matching
