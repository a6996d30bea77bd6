#include "calib/bundle/unit_inverse.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

// Eigenvalues below this are rounding: of sums of thousands.
constexpr double kSingular = 1e-13;
// Above, a Cholesky factor and its inverse have three digits and more.
constexpr double kNearlySingular = 1e-10;
constexpr long kMaxProducts = 200;
constexpr long kProductsPerLook = 8;  // between two solutions of the small problem
// Of the residual, over the eigenvalue; the eigenvalue's own error goes with its square.
constexpr double kTolerance = 1e-6;
constexpr std::uint64_t kStart = 0x1a2c205;

Eigen::VectorXd Start(long size) {
  Eigen::VectorXd start(size);
  for (long i = 0; i < size; ++i) {
    start[i] = 2 * UniformFromHash(HashOf(kStart, static_cast<std::uint64_t>(i))) - 1;
  }
  return start.normalized();
}

struct Eigenpair {
  double value = 0;
  Eigen::VectorXd vector;  // of length 1
};

// The largest eigenvalue of a symmetric positive definite matrix that is known by its product with
// a vector: Lanczos with full reorthogonalisation (Golub and Van Loan, Matrix Computations, 4th
// ed., sec. 10.1 to 10.3). Empty where it does not converge, or a product is not finite.
std::optional<Eigenpair> LargestEigenpair(
    long size, const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& product) {
  const long most = std::min(size, kMaxProducts);
  Eigen::MatrixXd basis(size, most);
  Eigen::VectorXd diagonal(most), beside = Eigen::VectorXd::Zero(most);
  Eigen::VectorXd next = Start(size);
  for (long k = 0; k < most; ++k) {
    basis.col(k) = next;
    next = product(basis.col(k));
    if (!next.allFinite()) return std::nullopt;
    diagonal[k] = basis.col(k).dot(next);
    // Twice is enough: what rounding leaves of the first is removed by the second.
    for (int pass = 0; pass < 2; ++pass) {
      next -= basis.leftCols(k + 1) * (basis.leftCols(k + 1).transpose() * next).eval();
    }
    beside[k] = next.norm();
    const bool is_exhausted = k + 1 == size;
    if (!is_exhausted && k + 1 < most && (k + 1) % kProductsPerLook != 0) {
      next /= beside[k];
      continue;
    }
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> small;
    small.computeFromTridiagonal(diagonal.head(k + 1), beside.head(k));
    const double value = small.eigenvalues()[k];
    const Eigen::VectorXd within = small.eigenvectors().col(k);
    if (is_exhausted || beside[k] * std::abs(within[k]) <= kTolerance * value) {
      return Eigenpair{value, (basis.leftCols(k + 1) * within).normalized()};
    }
    next /= beside[k];
  }
  return std::nullopt;
}

// The product of a matrix and its transpose, symmetric to the bit.
Eigen::MatrixXd TimesTransposed(const Eigen::MatrixXd& root) {
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(root.rows(), root.rows());
  product.selfadjointView<Eigen::Lower>().rankUpdate(root);
  product.triangularView<Eigen::StrictlyUpper>() = product.transpose();
  return product;
}

// By a Cholesky factor, in a twentieth of the time of all eigenvalues. Empty where the matrix is
// nearly singular: what is left of its least eigenvalue then decides, and rounding must not.
std::optional<UnitInverse> InverseByCholesky(const Eigen::MatrixXd& matrix) {
  const Eigen::LLT<Eigen::MatrixXd> llt(matrix);
  if (llt.info() != Eigen::Success) return std::nullopt;
  const auto most =
      LargestEigenpair(matrix.rows(), [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
        return matrix.selfadjointView<Eigen::Lower>() * v;
      });
  const auto weakest = LargestEigenpair(
      matrix.rows(), [&](const Eigen::VectorXd& v) -> Eigen::VectorXd { return llt.solve(v); });
  if (!most || !weakest || weakest->value * kNearlySingular > 1) return std::nullopt;
  UnitInverse out{1 / weakest->value, most->value, weakest->vector, {}};
  out.matrix =
      TimesTransposed(llt.matrixU().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.rows())));
  return out;
}

UnitInverse InverseByEigenvalues(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  UnitInverse out{eigen.eigenvalues()[0],
                  eigen.eigenvalues()[matrix.rows() - 1],
                  eigen.eigenvectors().col(0),
                  {}};
  if (out.least <= kSingular) return out;
  const Eigen::MatrixXd half =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
  out.matrix = TimesTransposed(half);
  return out;
}

}  // namespace

UnitInverse InverseOfUnitDiagonal(const Eigen::MatrixXd& matrix) {
  if (const auto inverse = InverseByCholesky(matrix)) return *inverse;
  return InverseByEigenvalues(matrix);
}

}  // namespace dtr::calib
