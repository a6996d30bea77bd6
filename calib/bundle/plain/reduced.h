// calib/bundle/plain/reduced.h -- internal to calib/bundle/plain: the reduced system's solution.
#pragma once
#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <optional>
#include <vector>

#include "calib/bundle/plain/layout.h"
#include "calib/bundle/plain/normal.h"

namespace dtr::calib::plain {

/// Solves the reduced system as the layout says. An iterative solution (Agarwal et al. 2010, sec.
/// 4) is one of an inexact Newton method; its preconditioner is every node's own block.
class ReducedSolver {
 public:
  ReducedSolver(const Problem& problem, const Layout& layout)
      : problem_(problem), layout_(layout) {}
  /// Empty where the matrix is not positive definite.
  std::optional<Eigen::VectorXd> Solve(const NormalEquations& normal);

 private:
  std::optional<Eigen::VectorXd> SolveDense(const std::vector<double>& blocks,
                                            const Eigen::VectorXd& right);
  std::optional<Eigen::VectorXd> SolveSparse(const std::vector<double>& blocks,
                                             const Eigen::VectorXd& right);

  const Problem& problem_;
  const Layout& layout_;
  Eigen::MatrixXd dense_;
  bool analysed_ = false;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>
      sparse_;
};

}  // namespace dtr::calib::plain
