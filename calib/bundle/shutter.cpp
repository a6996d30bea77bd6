#include "calib/bundle/shutter.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/bundle/gauge.h"
#include "calib/bundle/sight_rows.h"
#include "calib/distributions.h"

namespace dtr::calib {
namespace {

// Of columns of length 1: what is left of a turn that the other unknowns do not make as well.
constexpr double kDependent = 1e-6;

// Normal equations of everything but the points: lenses and poses as the covariance has them, then
// three turns an image, then the residuals themselves as a last column.
struct Normal {
  Eigen::MatrixXd matrix;
  long base = 0, turns = 0;
  double rows = 0;  ///< that are left when the points are fitted
  int coordinates = 0;
};

// The unknowns that the sights of one point depend on, in the order of their first use.
class Columns {
 public:
  long Of(long unknown) {
    const auto found = std::find(unknowns_.begin(), unknowns_.end(), unknown);
    if (found != unknowns_.end()) return found - unknowns_.begin();
    unknowns_.push_back(unknown);
    return static_cast<long>(unknowns_.size()) - 1;
  }
  const std::vector<long>& unknowns() const { return unknowns_; }

 private:
  std::vector<long> unknowns_;
};

// How far down the image, from -1/2 to 1/2, a sight's point is drawn. Not where it was seen: that
// holds the residual itself.
double RowShare(const Bundle& bundle, const BundleObservation& sight, const SightRows& rows) {
  const auto lens = static_cast<size_t>(bundle.images[static_cast<size_t>(sight.image)].lens);
  return (sight.pixel.y() + rows.residual.y()) / bundle.lenses[lens].height_px - 0.5;
}

void AddPoint(const Normalised& n, const Bundle& bundle, const BundleCovariance& layout,
              const std::vector<const BundleObservation*>& sights, Normal& normal) {
  Columns columns;
  std::vector<std::pair<const BundleObservation*, SightRows>> seen;
  for (const BundleObservation* sight : sights) {
    SightRows rows;
    if (!RowsOf(n, bundle, *sight, rows)) continue;
    const auto image = static_cast<size_t>(sight->image);
    const auto lens = static_cast<size_t>(bundle.images[image].lens);
    for (size_t k = 0; k < layout.free_params[lens].size(); ++k) {
      columns.Of(layout.lens_at[lens] + static_cast<long>(k));
    }
    for (long k = 0; k < 6; ++k) columns.Of(layout.image_at[image] + k);
    for (long k = 0; k < 3; ++k) columns.Of(normal.base + 3 * sight->image + k);
    seen.emplace_back(sight, std::move(rows));
  }
  const auto height = 2 * static_cast<long>(seen.size());
  if (height < 4) return;  // one sight says nothing about anything but its point
  const long last = columns.Of(normal.base + normal.turns);
  Eigen::MatrixXd by_point(height, 3);
  Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(height, last + 1);
  for (size_t i = 0; i < seen.size(); ++i) {
    const auto& [sight, rows] = seen[i];
    const auto at = 2 * static_cast<long>(i);
    const auto image = static_cast<size_t>(sight->image);
    const auto lens = static_cast<size_t>(bundle.images[image].lens);
    by_point.middleRows<2>(at) = rows.point;
    const auto& free = layout.free_params[lens];
    for (size_t k = 0; k < free.size(); ++k) {
      rest.block<2, 1>(at, columns.Of(layout.lens_at[lens] + static_cast<long>(k))) =
          rows.lens.col(free[k]);
    }
    const double share = RowShare(bundle, *sight, rows);
    for (long k = 0; k < 6; ++k) {
      rest.block<2, 1>(at, columns.Of(layout.image_at[image] + k)) = rows.pose.col(k);
    }
    for (long k = 0; k < 3; ++k) {
      rest.block<2, 1>(at, columns.Of(normal.base + 3 * sight->image + k)) =
          share * rows.pose.col(k);
    }
    rest.block<2, 1>(at, last) = rows.residual;
  }
  const Eigen::MatrixXd left = WithoutPoint(by_point, rest);
  const Eigen::MatrixXd product = left.transpose() * left;
  const auto& unknowns = columns.unknowns();
  for (size_t i = 0; i < unknowns.size(); ++i) {
    for (size_t j = 0; j < unknowns.size(); ++j) {
      normal.matrix(unknowns[i], unknowns[j]) +=
          product(static_cast<long>(i), static_cast<long>(j));
    }
  }
  normal.rows += static_cast<double>(left.rows());
  normal.coordinates += static_cast<int>(height);
}

// What lenses and poses leave of turns and residuals: their normal equations without them. The
// gauge's directions, which nothing determines, are held.
Eigen::MatrixXd WithoutBase(const Normalised& n, const BundleCovariance& layout,
                            const Normal& normal, long* gauge) {
  const long base = normal.base, rest = normal.turns + 1;
  const Eigen::MatrixXd open = GaugeDirections(n.poses, layout.image_at, base);
  *gauge = open.cols();
  Eigen::MatrixXd closed = normal.matrix.topLeftCorner(base, base);
  closed += closed.trace() / static_cast<double>(base) * open * open.transpose();
  const Eigen::VectorXd scale = closed.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd right = scale.asDiagonal() * normal.matrix.topRightCorner(base, rest);
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * closed * scale.asDiagonal());
  return normal.matrix.bottomRightCorner(rest, rest) - right.transpose() * ldlt.solve(right);
}

}  // namespace

ShutterTest TestShutter(const Adjusted& adjusted, const BundleCovariance& layout) {
  ShutterTest test;
  const Bundle& bundle = adjusted.bundle;
  Normal normal;
  normal.turns = 3 * static_cast<long>(bundle.images.size());
  normal.base = layout.image_at.back() + 6;
  if (normal.base + normal.turns > kMostUnknowns) {
    test.not_tested = "more unknowns than are worked out at once";
    return test;
  }
  normal.matrix.setZero(normal.base + normal.turns + 1, normal.base + normal.turns + 1);
  const Normalised n = Normalised::Around(bundle);
  std::vector<std::vector<const BundleObservation*>> tracks(bundle.points.size());
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (!adjusted.used[i]) continue;
    tracks[static_cast<size_t>(bundle.observations[i].point)].push_back(&bundle.observations[i]);
  }
  for (const auto& sights : tracks) AddPoint(n, bundle, layout, sights, normal);
  long gauge = 0;
  const Eigen::MatrixXd left = WithoutBase(n, layout, normal, &gauge);
  const long turns = normal.turns;
  // Turns in units of what they do to the residuals before anything else is fitted.
  const Eigen::VectorXd scale = normal.matrix.diagonal()
                                    .segment(normal.base, turns)
                                    .cwiseMax(1e-300)
                                    .cwiseSqrt()
                                    .cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      scale.asDiagonal() * left.topLeftCorner(turns, turns) * scale.asDiagonal());
  const Eigen::VectorXd along =
      eigen.eigenvectors().transpose() * (scale.asDiagonal() * left.topRightCorner(turns, 1));
  double explained = 0;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(turns);
  for (long k = 0; k < turns; ++k) {
    const double value = eigen.eigenvalues()[k];
    if (!(value > kDependent)) continue;
    inverse[k] = 1 / value;
    explained += along[k] * along[k] / value;
    ++test.freedom;
  }
  const double below = normal.rows - static_cast<double>(normal.base - gauge) - test.freedom;
  const double unexplained = left(turns, turns) - explained;
  if (test.freedom == 0 || !(below > 0) || !(unexplained > 0)) {
    test.not_tested = "the sights do not tell a turn from the other unknowns";
    return test;
  }
  const double variance = unexplained / below;
  test.p = FisherSurvival(explained / test.freedom / variance, test.freedom, below);
  test.amplitude_px = RootOfVariance((explained - test.freedom * variance) / normal.coordinates);
  const Eigen::MatrixXd half =
      scale.asDiagonal() * eigen.eigenvectors() * inverse.cwiseSqrt().asDiagonal();
  const Eigen::VectorXd found = -half * (inverse.cwiseSqrt().asDiagonal() * along);
  for (long i = 0; i < turns; i += 3) {
    const Eigen::Vector3d turn = found.segment<3>(i);
    const Eigen::Matrix3d covariance =
        variance * half.middleRows<3>(i) * half.middleRows<3>(i).transpose();
    const double squared = turn.dot(covariance.ldlt().solve(turn));
    test.turns_rad.push_back(turn.norm());
    test.sigmas.push_back(squared >= 0 ? std::sqrt(squared) : 0);
  }
  return test;
}

}  // namespace dtr::calib
