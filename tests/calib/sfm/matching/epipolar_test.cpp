#include "calib/sfm/matching/epipolar.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>

#include "calib/sfm/matching/planar_poses.h"
#include "calib/sfm/matching/robust_fit.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

const RelativePose kTruth = {
    Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix(),
    Eigen::Vector3d(1, 0.2, -0.3).normalized()};

PointPairs Exact(int count, std::uint64_t seed) {
  Random random(seed);
  PointPairs points;
  while (static_cast<int>(points.size()) < count) {
    const Eigen::Vector3d p(random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(3, 8));
    const Eigen::Vector3d q = kTruth.r * p + kTruth.t;
    points.Add(p.hnormalized(), q.hnormalized());
  }
  return points;
}

// Distance of a matrix from the truth, up to scale and sign.
double Apart(const Eigen::Matrix3d& m) {
  const Eigen::Matrix3d e = kTruth.Essential().normalized(), n = m.normalized();
  return std::min((n - e).norm(), (n + e).norm());
}

TEST(SfmEpipolar, FiveMatchesGiveTheTruthAmongTheirSolutions) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const PointPairs points = Exact(5, seed);
    double nearest = 1;
    for (const auto& e : EssentialFromFive(points, std::array{0, 1, 2, 3, 4})) {
      nearest = std::min(nearest, Apart(e));
    }
    EXPECT_LT(nearest, 1e-6) << seed;
  }
}

TEST(SfmEpipolar, SevenMatchesGiveTheTruthAmongTheirSolutions) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const PointPairs points = Exact(7, seed);
    double nearest = 1;
    for (const auto& f : FundamentalFromSeven(points, std::array{0, 1, 2, 3, 4, 5, 6})) {
      nearest = std::min(nearest, Apart(f));
    }
    EXPECT_LT(nearest, 1e-6) << seed;
  }
}

TEST(SfmEpipolar, APlaneLeavesTheTruthAndOneOtherPose) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, -0.3, 1) / 5;
  const Eigen::Matrix3d h = kTruth.r + kTruth.t * normal.transpose();
  PointPairs points;
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const double x = random.Uniform(-0.5, 0.5);
    const Eigen::Vector2d a(x, random.Uniform(-0.5, 0.5));
    points.Add(a, (h * a.homogeneous()).hnormalized());
  }
  for (const double scale : {2.0, -0.5}) {
    const auto both = PosesOfPlane(scale * h, points);
    ASSERT_TRUE(both);
    const auto off = [](const RelativePose& pose) {
      return (pose.r - kTruth.r).norm() + (pose.t - kTruth.t).norm();
    };
    EXPECT_LT(std::min(off((*both)[0]), off((*both)[1])), 1e-9);
    EXPECT_GT(std::max(off((*both)[0]), off((*both)[1])), 0.1);
    for (const RelativePose& pose : *both) {
      EXPECT_NEAR(pose.r.determinant(), 1, 1e-9);
      int in_front = 0;
      for (size_t i = 0; i < points.size(); ++i) {
        EXPECT_LT(SampsonSquared(pose.Essential(), points.a[i], points.b[i]), 1e-18);
        const auto depths = DepthsOf(pose, points.a[i], points.b[i]);
        in_front += depths && depths->minCoeff() > 0 ? 1 : 0;
      }
      // The other pose may have the plane on edge between its points.
      EXPECT_GE(2 * in_front, 20);
      if (off(pose) < 1e-9) {
        EXPECT_EQ(in_front, 20);
      }
    }
  }
  EXPECT_FALSE(PosesOfPlane(kTruth.r, points));
}

TEST(SfmEpipolar, ManyMatchesGiveTheFundamentalMatrix) {
  const PointPairs points = Exact(30, 1);
  const auto f = FundamentalFromMany(points, std::vector<double>(30, 1.0));
  ASSERT_TRUE(f);
  EXPECT_LT(Apart(*f), 1e-9);
}

TEST(SfmEpipolar, DerivativesByThePoseAreThoseOfDifferences) {
  const PointPairs points = Exact(10, 2);
  RelativePose pose = kTruth;
  pose.r = Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()).toRotationMatrix() * pose.r;
  const PoseDerivatives at(pose);
  constexpr double kStep = 1e-6;
  for (size_t i = 0; i < points.size(); ++i) {
    PoseRow row;
    at.Residual(points.a[i], points.b[i], &row);
    for (int k = 0; k < 5; ++k) {
      Eigen::Matrix<double, 5, 1> step = Eigen::Matrix<double, 5, 1>::Zero();
      step[k] = kStep;
      const double up = PoseDerivatives(at.Moved(step)).Residual(points.a[i], points.b[i], nullptr);
      const double down =
          PoseDerivatives(at.Moved(-step)).Residual(points.a[i], points.b[i], nullptr);
      EXPECT_NEAR(row[k], (up - down) / (2 * kStep), 1e-7);
    }
  }
}

TEST(SfmEpipolar, RobustFitFindsThePoseAmongHalfWrongMatches) {
  PointPairs points = Exact(100, 3);
  Random random(4);
  for (size_t i = 0; i < points.size(); i += 2) {
    points.b[i] = {random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6)};
  }
  const auto fit = FitEssential(points, 1e-3, 5);
  ASSERT_TRUE(fit);
  EXPECT_GE(fit->inliers.size(), 50u);
  EXPECT_LT(Eigen::AngleAxisd(kTruth.r.transpose() * fit->pose.r).angle(), 1e-3);
  EXPECT_GT(fit->pose.t.dot(kTruth.t), 0.9999);
}

}  // namespace
}  // namespace dtr::sfm::matching
