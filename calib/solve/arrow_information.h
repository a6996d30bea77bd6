// calib/solve/arrow_information.h -- normal equations of one lens and many poses, and their
// inverse.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace dtr::calib {

/// What residuals that each depend on the lens and on one pose say about both:
///   J^T J = | L      W_1  W_2 ... |
///           | W_1^T  V_1          |
///           | W_2^T       V_2     |
/// An arrow: everything about its inverse follows from the lens's part with the poses eliminated
/// (Triggs et al. 2000, sec. 6.1). Elimination is by orthogonal transformations of J itself, since
/// J^T J of a lens with many coefficients has lost the digits that tell them apart
/// (Golub & Van Loan, sec. 5.3).
class ArrowInformation {
 public:
  explicit ArrowInformation(int lens_parameters);

  /// Adds a pose with the information of its residuals: jacobians by lens and by pose, a row per
  /// residual. Returns the pose's index.
  int AddPose(const Eigen::MatrixXd& by_lens, const Eigen::MatrixXd& by_pose);

  int pose_count() const { return static_cast<int>(poses_.size()); }

  /// Inverts; before it, the functions below must not be called. False where a parameter is not
  /// determined: with columns scaled to length 1, J is singular to working precision.
  bool Invert();

  /// Covariances for residuals of unit variance.
  const Eigen::MatrixXd& lens_covariance() const { return lens_covariance_; }
  Eigen::MatrixXd PoseCovariance(int pose) const;
  /// Cov(lens, pose), lens parameters as rows.
  Eigen::MatrixXd LensPoseCovariance(int pose) const;

  /// Variance matrix of a linear function of everything: by_lens * d lens + sum by_pose[i] * d
  /// pose_i.
  Eigen::MatrixXd VarianceOf(const Eigen::MatrixXd& by_lens,
                             const std::vector<Eigen::MatrixXd>& by_pose) const;

  /// x^T (J^T J) x: squared length of an error in units of its own standard deviations.
  double SquaredLength(const Eigen::VectorXd& lens_error,
                       const std::vector<Eigen::VectorXd>& pose_errors) const;

  /// Largest over smallest singular value of the lens's part of J, poses eliminated and columns
  /// scaled to length 1: 1 for independent parameters, 1e12 and beyond where a combination of them
  /// is noise. Independent of the parameters' units.
  double condition() const { return condition_; }
  /// The least determined combination, per parameter in units of its own scale; unit length.
  const Eigen::VectorXd& weakest() const { return weakest_; }

 private:
  // Of a pose's rows Q^T [J_pose J_lens] = [R T; 0 B]: the B of all poses are the lens's part.
  struct PoseBlock {
    Eigen::MatrixXd r, t;
    Eigen::MatrixXd own_inverse;  // V^-1
    Eigen::MatrixXd by_lens;      // V^-1 W^T: how the pose follows the lens, with a minus
  };
  Eigen::MatrixXd reduced_;  // upper triangular, of the stacked B
  std::vector<PoseBlock> poses_;
  Eigen::MatrixXd lens_covariance_;
  Eigen::VectorXd weakest_;
  double condition_ = 0;
};

}  // namespace dtr::calib
