#include "calib/bundle/unit_inverse.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>

#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

// A matrix of unit diagonal whose eigenvalues spread by about `spread`, the last `repeated` of them
// alike.
Eigen::MatrixXd WithSpread(long size, double spread, long repeated, std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd any(size, size);
  for (double& value : any.reshaped()) value = random.Normal();
  const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(any).householderQ();
  Eigen::VectorXd values(size);
  for (long i = 0; i < size; ++i) {
    const long step = std::min(i, size - repeated);
    values[i] = std::pow(spread, -static_cast<double>(step) / static_cast<double>(size - repeated));
  }
  const Eigen::MatrixXd matrix = q * values.asDiagonal() * q.transpose();
  const Eigen::VectorXd scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  return 0.5 * (scaled + scaled.transpose());
}

TEST(UnitInverse, IsThatOfAllEigenvalues) {
  for (const double spread : {1.0, 10.0, 1e4, 1e8}) {
    for (const long size : {1, 2, 7, 60, 230}) {
      for (const long repeated : {1, 3}) {
        if (size <= repeated) continue;
        const Eigen::MatrixXd matrix = WithSpread(size, spread, repeated, 7);
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> all(matrix);
        const UnitInverse inverse = InverseOfUnitDiagonal(matrix);
        const double least = all.eigenvalues()[0], most = all.eigenvalues()[size - 1];
        // Both err by rounding of the largest eigenvalue.
        EXPECT_NEAR(inverse.least, least, 1e-9 * least + 1e-14 * most) << size << " " << spread;
        EXPECT_NEAR(inverse.most, most, 1e-9 * most);
        EXPECT_NEAR(inverse.weakest.norm(), 1, 1e-12);
        ASSERT_EQ(inverse.matrix.rows(), size);
        EXPECT_LT((least * (inverse.matrix * inverse.weakest) - inverse.weakest).norm(), 1e-5);
        EXPECT_EQ(inverse.matrix, inverse.matrix.transpose());
        const Eigen::MatrixXd one = matrix * inverse.matrix;
        EXPECT_LT((one - Eigen::MatrixXd::Identity(size, size)).norm(),
                  1e-13 * spread * 100 + 1e-11);
      }
    }
  }
}

TEST(UnitInverse, ANearlySingularMatrixIsDecidedByItsEigenvalues) {
  const UnitInverse near = InverseOfUnitDiagonal(WithSpread(40, 1e11, 1, 3));
  EXPECT_GT(near.matrix.size(), 0);
  EXPECT_GT(near.least, 0);
  Eigen::MatrixXd twins = Eigen::MatrixXd::Identity(6, 6);
  twins(2, 4) = twins(4, 2) = 1;  // two unknowns that only their sum is known of
  const UnitInverse none = InverseOfUnitDiagonal(twins);
  EXPECT_EQ(none.matrix.size(), 0);
  EXPECT_NEAR(none.least, 0, 1e-15);
  EXPECT_NEAR(std::abs(none.weakest[2]), std::sqrt(0.5), 1e-12);
  twins(2, 4) = twins(4, 2) = 2;  // no positive definite matrix at all
  EXPECT_EQ(InverseOfUnitDiagonal(twins).matrix.size(), 0);
}

}  // namespace
}  // namespace dtr::calib
