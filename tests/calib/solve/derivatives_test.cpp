// Values and derivatives of what Ceres is given, against LensMap and against differences.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>

#include "calib/lens_map.h"
#include "calib/solve/arrow_information.h"
#include "calib/solve/reprojection.h"
#include "tests/calib/solve/synthetic_views.h"

namespace dtr::calib {
namespace {

using testing::ExactViews;
using testing::kBoard;
using testing::TypicalCamera;

// Central differences of step h: h^2 for curvature, 1e-13 * 600 px / h for rounding.
constexpr double kStep = 1e-5, kSameDerivative = 1e-6;  // relative to the largest of the row
constexpr double kSameValuePx = 1e-10;

TEST(ReprojectionCost, PredictsWhatLensMapDrawsAndItsDerivativesAreThoseOfDifferences) {
  for (const BoardModel model : kBoardModels) {
    const LensCamera camera = TypicalCamera(model);
    const LensMap map(camera);
    const auto exact = ExactViews(camera, 4, 6);
    const LensCoordinates lens = CoordinatesAround(model, camera, 0.6);
    const int count = FreeParameterCount(model);
    for (size_t view = 0; view < exact.views.size(); ++view) {
      const Eigen::Vector3d pivot = MiddleOf(kBoard);
      const PoseCoordinates pose = CoordinatesAround(exact.cam_from_board[view], pivot);
      for (const int id : {0, 8, 30, 53}) {
        const Eigen::Vector2d observed(300, 200);
        const auto cost = ReprojectionCost(lens, pose, kBoard.Corner(id) - pivot, observed);
        std::vector<double> theta(static_cast<size_t>(count), 0.0), motion(6, 0.0);
        motion = {1e-3, -2e-3, 5e-4, 1e-3, 1e-3, -1e-3};
        const auto value = [&] {
          const double* blocks[] = {theta.data(), motion.data()};
          Eigen::Vector2d residual;
          EXPECT_TRUE(cost->Evaluate(blocks, residual.data(), nullptr));
          return residual;
        };
        const auto pixel = map.PixelFromCam(PoseAt(pose, motion.data(), pivot) * kBoard.Corner(id));
        ASSERT_TRUE(pixel);
        EXPECT_LT((value() + observed - *pixel).norm(), kSameValuePx) << NameOf(model);
        Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> by_lens(2, count);
        Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_pose;
        double* jacobians[] = {by_lens.data(), by_pose.data()};
        const double* blocks[] = {theta.data(), motion.data()};
        Eigen::Vector2d residual;
        ASSERT_TRUE(cost->Evaluate(blocks, residual.data(), jacobians));
        const auto difference = [&](double& parameter) -> Eigen::Vector2d {
          const double at = parameter;
          parameter = at + kStep;
          const Eigen::Vector2d above = value();
          parameter = at - kStep;
          const Eigen::Vector2d below = value();
          parameter = at;
          return (above - below) / (2 * kStep);
        };
        const double largest =
            std::max(by_lens.cwiseAbs().maxCoeff(), by_pose.cwiseAbs().maxCoeff());
        for (int i = 0; i < count; ++i) {
          const Eigen::Vector2d expected = difference(theta[static_cast<size_t>(i)]);
          EXPECT_LT((by_lens.col(i) - expected).norm(), kSameDerivative * largest)
              << NameOf(model) << " " << FreeParameterNames(model)[static_cast<size_t>(i)];
        }
        for (int i = 0; i < 6; ++i) {
          const Eigen::Vector2d expected = difference(motion[static_cast<size_t>(i)]);
          EXPECT_LT((by_pose.col(i) - expected).norm(), kSameDerivative * largest)
              << NameOf(model) << " motion " << i;
        }
      }
    }
  }
}

TEST(ReprojectionCost, OnTheAxisOfAFisheyeDerivativesAreFinite) {
  const LensCamera camera = TypicalCamera(BoardModel::kFisheye);
  const LensCoordinates lens = CoordinatesAround(BoardModel::kFisheye, camera, 1);
  PoseCoordinates pose;
  pose.translation = {0, 0, 2};
  const auto cost = ReprojectionCost(lens, pose, {0, 0, 0}, {322, 236});
  const double theta[8] = {}, motion[6] = {};
  const double* blocks[] = {theta, motion};
  double residual[2], by_lens[16], by_pose[12];
  double* jacobians[] = {by_lens, by_pose};
  ASSERT_TRUE(cost->Evaluate(blocks, residual, jacobians));
  EXPECT_EQ(residual[0], 0);
  for (const double d : by_lens) EXPECT_TRUE(std::isfinite(d));
  for (const double d : by_pose) EXPECT_TRUE(std::isfinite(d));
  EXPECT_NEAR(by_pose[3], 105, 1e-9);  // fx / z
}

Eigen::MatrixXd RandomMatrix(long rows, long columns, Random& random) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.Normal(); });
}

TEST(ArrowInformation, GivesTheBlocksOfTheDenseInverse) {
  Random random(3);
  const long lens = 5, poses = 3, unknowns = lens + 6 * poses;
  ArrowInformation arrow(lens);
  Eigen::MatrixXd jacobian(0, unknowns);
  for (long i = 0; i < poses; ++i) {
    Eigen::MatrixXd by_lens = RandomMatrix(20, lens, random);
    by_lens.col(2) *= 1e6;  // parameters of very different size
    by_lens.col(4) *= 1e-8;
    const Eigen::MatrixXd by_pose = RandomMatrix(20, 6, random);
    EXPECT_EQ(arrow.AddPose(by_lens, by_pose), i);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(20, unknowns);
    rows.leftCols(lens) = by_lens;
    rows.middleCols(lens + 6 * i, 6) = by_pose;
    jacobian.conservativeResize(jacobian.rows() + 20, unknowns);
    jacobian.bottomRows(20) = rows;
  }
  ASSERT_TRUE(arrow.Invert());
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = jacobian * scale.asDiagonal();
  const Eigen::MatrixXd inverse =
      scale.asDiagonal() * (scaled.transpose() * scaled).inverse() * scale.asDiagonal();
  const auto expect_same = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    ASSERT_EQ(a.rows(), b.rows());
    for (long i = 0; i < a.size(); ++i) {
      EXPECT_NEAR(a.data()[i], b.data()[i], 1e-10 * std::abs(b.data()[i]) + 1e-30);
    }
  };
  expect_same(arrow.lens_covariance(), inverse.topLeftCorner(lens, lens));
  Eigen::MatrixXd by_lens = RandomMatrix(2, lens, random);
  std::vector<Eigen::MatrixXd> by_pose;
  Eigen::MatrixXd function(2, unknowns);
  function.leftCols(lens) = by_lens;
  for (int i = 0; i < poses; ++i) {
    expect_same(arrow.PoseCovariance(i), inverse.block(lens + 6 * i, lens + 6 * i, 6, 6));
    expect_same(arrow.LensPoseCovariance(i), inverse.block(0, lens + 6 * i, lens, 6));
    by_pose.push_back(RandomMatrix(2, 6, random));
    function.middleCols(lens + 6 * i, 6) = by_pose.back();
  }
  expect_same(arrow.VarianceOf(by_lens, by_pose), function * inverse * function.transpose());
  const Eigen::VectorXd error = RandomMatrix(unknowns, 1, random);
  std::vector<Eigen::VectorXd> pose_errors;
  for (long i = 0; i < poses; ++i) pose_errors.push_back(error.segment(lens + 6 * i, 6));
  EXPECT_NEAR(arrow.SquaredLength(error.head(lens), pose_errors) / (jacobian * error).squaredNorm(),
              1, 1e-12);
}

TEST(ArrowInformation, UnitsDoNotMatterAndWhatIsNotDeterminedIsNamed) {
  Random random(4);
  const Eigen::MatrixXd by_lens = RandomMatrix(30, 4, random),
                        by_pose = RandomMatrix(30, 6, random);
  ArrowInformation plain(4), scaled(4), degenerate(4);
  plain.AddPose(by_lens, by_pose);
  const Eigen::Vector4d units(1e3, 1, 1e-3, 1e-8);
  scaled.AddPose(by_lens * units.asDiagonal(), by_pose);
  ASSERT_TRUE(plain.Invert());
  ASSERT_TRUE(scaled.Invert());
  EXPECT_NEAR(scaled.condition() / plain.condition(), 1, 1e-9);
  Eigen::MatrixXd twice = by_lens;
  twice.col(3) = 2 * twice.col(1);  // two names for one thing
  degenerate.AddPose(twice, by_pose);
  EXPECT_FALSE(degenerate.Invert());
  EXPECT_GT(std::abs(degenerate.weakest()[1]), 0.5);
  EXPECT_GT(std::abs(degenerate.weakest()[3]), 0.5);
}

}  // namespace
}  // namespace dtr::calib
