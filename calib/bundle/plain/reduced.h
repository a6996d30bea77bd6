// calib/bundle/plain/reduced.h -- internal to calib/bundle/plain: the reduced system's solution.
#pragma once
#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <optional>
#include <vector>

#include "calib/bundle/plain/layout.h"

namespace dtr::calib::plain {

/// Cholesky's factorisation of the blocks' matrix, dense or sparse as the layout says.
class ReducedSolver {
 public:
  explicit ReducedSolver(const Layout& layout) : layout_(layout) {}
  /// Empty where the matrix is not positive definite.
  std::optional<Eigen::VectorXd> Solve(const std::vector<double>& blocks,
                                       const Eigen::VectorXd& right);

 private:
  std::optional<Eigen::VectorXd> SolveDense(const std::vector<double>& blocks,
                                            const Eigen::VectorXd& right);
  std::optional<Eigen::VectorXd> SolveSparse(const std::vector<double>& blocks,
                                             const Eigen::VectorXd& right);

  const Layout& layout_;
  Eigen::MatrixXd dense_;
  bool analysed_ = false;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>
      sparse_;
};

}  // namespace dtr::calib::plain
