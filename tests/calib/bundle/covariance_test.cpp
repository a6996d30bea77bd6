#include "calib/bundle/covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "tests/calib/bundle/synthetic_bundle.h"

namespace dtr::calib {
namespace {

using testing::LookAt;
using testing::MakeBundle;
using testing::Moved;
using testing::SceneSpec;

AdjustOptions AllFree() {
  AdjustOptions options;
  options.lens = LensFreedom::kAll;
  options.outlier_sigmas = 0;  // normal noise alone: nothing to leave out
  return options;
}

SceneSpec Small(std::uint64_t seed) {
  return {.images = 5, .points = 60, .noise_px = 0.3, .seed = seed};
}

// The true scene with new noise on its observations: the start of a solve that knows its gauge.
Bundle Noisy(const Bundle& truth, std::uint64_t seed) {
  Bundle bundle = truth;
  Random random(seed);
  for (auto& observation : bundle.observations) {
    const double x = random.Normal();
    observation.pixel += 0.3 * Eigen::Vector2d(x, random.Normal());
  }
  return bundle;
}

TEST(Covariance, ErrorsAreWhatIsPredicted) {
  SceneSpec spec = Small(11);
  spec.noise_px = 0;
  const Bundle truth = MakeBundle(spec);
  double lens_chi2 = 0, focal_chi2 = 0, transfer_chi2 = 0;
  constexpr int kSolves = 60;
  for (int s = 0; s < kSolves; ++s) {
    Adjusted out = Adjust(Noisy(truth, 100 + static_cast<std::uint64_t>(s)), AllFree());
    out.sigma_px = 0.3;  // known here: the scatter of sigma itself is no part of the question
    const BundleCovariance covariance = CovarianceOf(out, AllFree());
    ASSERT_TRUE(covariance.computed && covariance.determined);
    EXPECT_EQ(covariance.gauge_freedom, 7);
    const Eigen::MatrixXd of_lens = covariance.OfLens(out.bundle, 0);
    const Eigen::VectorXd error =
        Eigen::Map<const Eigen::VectorXd>(out.bundle.lenses[0].params.data(), 5) -
        Eigen::Map<const Eigen::VectorXd>(truth.lenses[0].params.data(), 5);
    lens_chi2 += error.dot(of_lens.ldlt().solve(error)) / 5;
    focal_chi2 += error[0] * error[0] / of_lens(0, 0);
    // A point as cameras 0 and 4 place it by its true pixels, seen by camera 2.
    const Eigen::Vector3d p(0.3, -0.2, 0.4);
    const auto seen = [&](const Bundle& b, int i, const Eigen::Vector3d& point) {
      const BundleImage& image = b.images[static_cast<size_t>(i)];
      return *b.lenses[0].PixelFromCam(image.cam_from_world * point);
    };
    Bundle placed = out.bundle;
    placed.points = {p.homogeneous()};
    placed.point_ids = {1};
    placed.observations = {{0, 0, seen(truth, 0, p)}, {4, 0, seen(truth, 4, p)}};
    AdjustOptions point_only = AllFree();
    point_only.lens = LensFreedom::kFixed;
    point_only.fix_poses = true;
    const Bundle solved = Adjust(placed, point_only).bundle;
    const Eigen::Vector2d off = seen(out.bundle, 2, solved.points[0].head<3>()) - seen(truth, 2, p);
    const Eigen::Matrix2d predicted = TransferCovariance(out.bundle, covariance, p, 0, 4, 2);
    transfer_chi2 += off.dot(predicted.ldlt().solve(off)) / 2;
  }
  // Means of 60 x 5, 60 and 60 x 2 squared normals: 1 +- 3 standard deviations.
  EXPECT_NEAR(lens_chi2 / kSolves, 1, 3 * std::sqrt(2.0 / (5 * kSolves)));
  EXPECT_NEAR(focal_chi2 / kSolves, 1, 3 * std::sqrt(2.0 / kSolves));
  EXPECT_NEAR(transfer_chi2 / kSolves, 1, 3 * std::sqrt(1.0 / kSolves));
}

TEST(Covariance, PosesErrInTheGaugeOfTheStartAsPredicted) {
  SceneSpec spec = Small(12);
  spec.noise_px = 0;
  const Bundle truth = MakeBundle(spec);
  double chi2 = 0;
  constexpr int kSolves = 40;
  for (int s = 0; s < kSolves; ++s) {
    Adjusted out = Adjust(Noisy(truth, 500 + static_cast<std::uint64_t>(s)), AllFree());
    out.sigma_px = 0.3;
    const BundleCovariance covariance = CovarianceOf(out, AllFree());
    for (int i = 0; i < 5; ++i) {
      const Pose& a = out.bundle.images[static_cast<size_t>(i)].cam_from_world;
      const Pose& b = truth.images[static_cast<size_t>(i)].cam_from_world;
      const Eigen::Vector3d shift = a.TargetOriginInSource() - b.TargetOriginInSource();
      chi2 += shift.dot(covariance.OfImage(i).bottomRightCorner<3, 3>().ldlt().solve(shift)) / 3;
    }
  }
  EXPECT_NEAR(chi2 / (5 * kSolves), 1, 0.25);
}

// Five photos in a row see a feature off by the same: taken closely, they say no more than one
// does.
Bundle WithErrorsOfFivePhotosInARow(const Bundle& truth, std::uint64_t seed) {
  Bundle bundle = truth;
  for (auto& observation : bundle.observations) {
    const auto point = static_cast<std::uint64_t>(observation.point);
    Random random((seed * 100000 + point) * 100 +
                  static_cast<std::uint64_t>(observation.image / 5));
    const double x = random.Normal();
    observation.pixel += 0.3 * Eigen::Vector2d(x, random.Normal());
  }
  return bundle;
}

TEST(Covariance, ErrorsThatTheObservationsOfAPointShareAreNotTakenForIndependent) {
  SceneSpec spec{.images = 30, .points = 800, .noise_px = 0, .seed = 21};
  const Bundle truth = MakeBundle(spec);
  double chi2 = 0;
  constexpr int kSolves = 10;
  for (int s = 0; s < kSolves; ++s) {
    const Bundle seen = WithErrorsOfFivePhotosInARow(truth, 900 + static_cast<std::uint64_t>(s));
    const Adjusted out = Adjust(seen, AllFree());
    const Eigen::VectorXd error =
        Eigen::Map<const Eigen::VectorXd>(out.bundle.lenses[0].params.data(), 5) -
        Eigen::Map<const Eigen::VectorXd>(truth.lenses[0].params.data(), 5);
    const Eigen::MatrixXd predicted = CovarianceOf(out, AllFree()).OfLens(out.bundle, 0);
    chi2 += error.dot(predicted.ldlt().solve(error)) / 5;
  }
  // With each observation taken for independent of the others: 3.3.
  EXPECT_NEAR(chi2 / kSolves, 1, 3 * std::sqrt(2.0 / (5 * kSolves)));
}

TEST(Covariance, TransferDoesNotDependOnTheWorld) {
  const Bundle bundle = MakeBundle(Small(3));
  Similarity world;
  world.scale = 250;
  world.rotation = Eigen::Quaterniond(0.8, 0.2, -0.4, 0.4).normalized();
  world.translation << 1000, -300, 20;
  const Adjusted here = Adjust(bundle, AllFree()), there = Adjust(Moved(bundle, world), AllFree());
  const Eigen::Vector3d p(0.3, -0.2, 0.4);
  const Eigen::Matrix2d a =
      TransferCovariance(here.bundle, CovarianceOf(here, AllFree()), p, 0, 4, 2);
  const Eigen::Matrix2d b =
      TransferCovariance(there.bundle, CovarianceOf(there, AllFree()), world * p, 0, 4, 2);
  EXPECT_LT((a - b).norm(), 1e-5 * a.norm());
}

TEST(Covariance, ConditionDoesNotDependOnUnits) {
  const Bundle bundle = MakeBundle(Small(3));
  Similarity world;
  world.scale = 1e5;
  const double a = CovarianceOf(Adjust(bundle, AllFree()), AllFree()).condition;
  const double b = CovarianceOf(Adjust(Moved(bundle, world), AllFree()), AllFree()).condition;
  EXPECT_NEAR(a, b, 1e-4 * a);
  EXPECT_GT(a, 1);
}

TEST(Covariance, KnownPositionsSettleTheGauge) {
  const Bundle bundle = MakeBundle(Small(4));
  AdjustOptions options = AllFree();
  for (int i = 0; i < 5; ++i) {
    options.positions.push_back(
        {i, bundle.images[static_cast<size_t>(i)].cam_from_world.TargetOriginInSource(),
         Eigen::Vector3d::Constant(0.01)});
  }
  const BundleCovariance covariance = CovarianceOf(Adjust(bundle, options), options);
  EXPECT_EQ(covariance.gauge_freedom, 0);
  EXPECT_TRUE(covariance.determined);
  options.positions.clear();
  options.distances = {{0, 4, 8.0, 0.01}};
  EXPECT_EQ(CovarianceOf(Adjust(bundle, options), options).gauge_freedom, 6);
}

TEST(Covariance, IsSymmetricAndPositive) {
  const Adjusted out = Adjust(MakeBundle(Small(5)), AllFree());
  const BundleCovariance covariance = CovarianceOf(out, AllFree());
  EXPECT_LT((covariance.matrix - covariance.matrix.transpose()).norm(),
            1e-12 * covariance.matrix.norm());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance.OfLens(out.bundle, 0));
  EXPECT_GT(eigen.eigenvalues()[0], 0);
}

}  // namespace
}  // namespace dtr::calib
