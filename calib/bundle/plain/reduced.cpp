#include "calib/bundle/plain/reduced.h"

#include <Eigen/Cholesky>

#include "calib/bundle/plain/iterative.h"

namespace dtr::calib::plain {
namespace {

// Calls `entry(row, column, value)` with every entry on or below the diagonal.
template <typename Entry>
void ForEachEntry(const Layout& layout, const std::vector<double>& blocks, const Entry& entry) {
  for (const Layout::Block& block : layout.blocks()) {
    const int width = layout.width(block.high);
    const long low = layout.offset(block.low), high = layout.offset(block.high);
    for (int i = 0; i < layout.size(block.low); ++i) {
      for (int j = block.low == block.high ? i : 0; j < layout.size(block.high); ++j) {
        const long a = low + i, b = high + j;
        entry(std::max(a, b), std::min(a, b),
              blocks[block.begin + static_cast<size_t>(i * width + j)]);
      }
    }
  }
}

}  // namespace

std::optional<Eigen::VectorXd> ReducedSolver::Solve(const NormalEquations& normal) {
  std::optional<Eigen::VectorXd> step;
  switch (layout_.solution()) {
    case Solution::kDense:
      step = SolveDense(normal.blocks(), normal.right());
      break;
    case Solution::kSparse:
      step = SolveSparse(normal.blocks(), normal.right());
      break;
    case Solution::kIterative:
      step = SolveIteratively(problem_, layout_, normal);
  }
  if (step && !step->allFinite()) return {};
  return step;
}

std::optional<Eigen::VectorXd> ReducedSolver::SolveDense(const std::vector<double>& blocks,
                                                         const Eigen::VectorXd& right) {
  dense_.setZero(layout_.unknowns(), layout_.unknowns());
  ForEachEntry(layout_, blocks,
               [&](long row, long column, double value) { dense_(row, column) = value; });
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> llt(dense_);  // in place
  if (llt.info() != Eigen::Success) return {};
  return llt.solve(right);
}

std::optional<Eigen::VectorXd> ReducedSolver::SolveSparse(const std::vector<double>& blocks,
                                                          const Eigen::VectorXd& right) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(blocks.size());
  ForEachEntry(layout_, blocks, [&](long row, long column, double value) {
    entries.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
  });
  const auto side = static_cast<int>(layout_.unknowns());
  Eigen::SparseMatrix<double> matrix(side, side);
  matrix.setFromTriplets(entries.begin(), entries.end());
  if (!analysed_) sparse_.analyzePattern(matrix);
  analysed_ = true;
  sparse_.factorize(matrix);
  if (sparse_.info() != Eigen::Success || !(sparse_.vectorD().minCoeff() > 0)) return {};
  return sparse_.solve(right);
}

}  // namespace dtr::calib::plain
