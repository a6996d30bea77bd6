#include "calib/similarity.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cassert>
#include <cmath>
#include <string>

#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

// Width over length below which points count as a line. Double leaves 1e-9 of coordinates of 1e7
// and extent 1; real camera paths that bend at all are far above.
constexpr double kThinnest = 1e-6;

using Points = Eigen::Matrix3Xd;

Points Stack(std::span<const Eigen::Vector3d> points, const char* which) {
  Points stacked(3, static_cast<Eigen::Index>(points.size()));
  for (size_t i = 0; i < points.size(); ++i) stacked.col(static_cast<Eigen::Index>(i)) = points[i];
  if (!stacked.allFinite()) {
    throw Error(std::string("alignment: expected finite points, found NaN or infinity in the ") +
                which + " set");
  }
  return stacked;
}

void RejectLines(const Points& centred, const char* which) {
  const Eigen::Vector3d extent = Eigen::JacobiSVD<Points>(centred).singularValues();
  if (!(extent(0) > 0) || !(extent(1) > kThinnest * extent(0))) {
    throw Error(std::string("alignment: expected points that are not on one line, found the ") +
                which + " set " + (extent(0) > 0 ? "on a line" : "in one point") +
                "; the rotation about it is unknown: use more points");
  }
}

}  // namespace

Eigen::Vector3d MeanOf(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  return mean;
}

Similarity Similarity::Inverse() const {
  const Eigen::Quaterniond a_from_b = rotation.conjugate();
  return {1 / scale, a_from_b, -(a_from_b * translation) / scale};
}

Pose Similarity::CamFromB(const Pose& cam_from_a) const {
  const Eigen::Vector3d center_in_b = *this * cam_from_a.TargetOriginInSource();
  const Eigen::Quaterniond cam_from_b = (cam_from_a.rotation * rotation.conjugate()).normalized();
  return {cam_from_b, -(cam_from_b * center_in_b)};
}

Similarity AlignPoints(std::span<const Eigen::Vector3d> points_in_a,
                       std::span<const Eigen::Vector3d> points_in_b) {
  if (points_in_a.size() != points_in_b.size() || points_in_a.size() < 3) {
    throw Error("alignment: expected two sets of at least 3 points each, found " +
                std::to_string(points_in_a.size()) + " and " + std::to_string(points_in_b.size()) +
                "; give more of them");
  }
  Points a = Stack(points_in_a, "first"), b = Stack(points_in_b, "second");
  // Differences to the mean first: coordinates may be map coordinates of 1e7.
  const Eigen::Vector3d mean_a = a.rowwise().mean(), mean_b = b.rowwise().mean();
  a.colwise() -= mean_a;
  b.colwise() -= mean_b;
  RejectLines(a, "first");
  RejectLines(b, "second");

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(b * a.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Similarity b_from_a;
  b_from_a.scale = 0;
  // Products of finite coordinates may be infinite: then the decomposition has no values.
  if (svd.info() == Eigen::Success) {
    // Of the turns U S V^T take the one that is no reflection; for flat sets both fit equally well.
    Eigen::Vector3d signs = Eigen::Vector3d::Ones();
    if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs(2) = -1;
    b_from_a.rotation = Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * signs.asDiagonal() *
                                                           svd.matrixV().transpose()))
                            .normalized();
    b_from_a.scale = svd.singularValues().dot(signs) / a.squaredNorm();
  }
  if (!(b_from_a.scale > 0) || !std::isfinite(b_from_a.scale)) {
    throw Error("alignment: the two sets of points have nothing in common (no positive scale)");
  }
  b_from_a.translation = mean_b - b_from_a.scale * (b_from_a.rotation * mean_a);
  return b_from_a;
}

Similarity AlignPointsAtScale(std::span<const Eigen::Vector3d> points_in_a,
                              std::span<const Eigen::Vector3d> points_in_b, double b_per_a) {
  assert(b_per_a > 0);
  // The best turn is the same for every scale; the shift carries mean to mean.
  Similarity b_from_a = AlignPoints(points_in_a, points_in_b);
  const Eigen::Vector3d mean_a = MeanOf(points_in_a);
  const Eigen::Vector3d mean_b = b_from_a * mean_a;
  b_from_a.scale = b_per_a;
  b_from_a.translation = mean_b - b_per_a * (b_from_a.rotation * mean_a);
  return b_from_a;
}

Similarity TurnAndShift(std::span<const Eigen::Vector3d> points_in_a,
                        std::span<const Eigen::Vector3d> points_in_b,
                        std::span<const Eigen::Vector3d> sigmas) {
  constexpr int kMaxSteps = 20;
  const Eigen::Vector3d middle = MeanOf(points_in_a);
  const auto rows = 3 * static_cast<Eigen::Index>(points_in_a.size());
  const auto misses_of = [&](const Similarity& b_from_a) {
    Eigen::VectorXd misses(rows);
    for (size_t i = 0; i < points_in_a.size(); ++i) {
      misses.segment<3>(3 * static_cast<Eigen::Index>(i)) =
          (b_from_a * points_in_a[i] - points_in_b[i]).cwiseQuotient(sigmas[i]);
    }
    return misses;
  };
  Similarity best;
  Eigen::VectorXd misses = misses_of(best);
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::MatrixXd columns(rows, 6);
    for (size_t i = 0; i < points_in_a.size(); ++i) {
      const Eigen::Vector3d arm = best.rotation * (points_in_a[i] - middle);
      const Eigen::Vector3d weight = sigmas[i].cwiseInverse();
      auto block = columns.middleRows<3>(3 * static_cast<Eigen::Index>(i));
      block.leftCols<3>() = weight.asDiagonal();
      for (int k = 0; k < 3; ++k) {
        block.col(3 + k) = weight.cwiseProduct(Eigen::Vector3d::Unit(k).cross(arm));
      }
    }
    const Eigen::VectorXd g = columns.completeOrthogonalDecomposition().solve(-misses);
    const Eigen::Vector3d turn = g.tail<3>();
    Similarity next;
    if (turn.norm() > 0) next.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized());
    next.rotation = (next.rotation * best.rotation).normalized();
    next.translation = best * middle + g.head<3>() - next.rotation * middle;
    const Eigen::VectorXd left = misses_of(next);
    if (!(left.squaredNorm() < misses.squaredNorm())) break;
    best = next;
    misses = left;
  }
  return best;
}

double AlignmentRms(const Similarity& b_from_a, std::span<const Eigen::Vector3d> points_in_a,
                    std::span<const Eigen::Vector3d> points_in_b) {
  assert(points_in_a.size() == points_in_b.size() && !points_in_a.empty());
  double sum = 0;
  for (size_t i = 0; i < points_in_a.size(); ++i) {
    sum += (b_from_a * points_in_a[i] - points_in_b[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(points_in_a.size()));
}

}  // namespace dtr::calib
