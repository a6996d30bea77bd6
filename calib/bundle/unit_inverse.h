// calib/bundle/unit_inverse.h -- internal to calib/bundle: a large covariance out of its inverse.
#pragma once
#include <Eigen/Core>

namespace dtr::calib {

/// The inverse of a symmetric matrix, and how far from singular that is.
struct UnitInverse {
  double least = 0, most = 0;  ///< eigenvalues
  Eigen::VectorXd weakest;     ///< eigenvector of `least`, of length 1
  Eigen::MatrixXd matrix;      ///< empty where `least` is rounding, or below zero
};

/// Of a symmetric matrix of finite numbers with a diagonal of ones: by its Cholesky factor, with
/// the ends of the spectrum by Lanczos; all eigenvalues, which take some twenty times as long,
/// where it is nearly singular. Deterministic.
UnitInverse InverseOfUnitDiagonal(const Eigen::MatrixXd& matrix);

}  // namespace dtr::calib
