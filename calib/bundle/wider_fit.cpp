#include "calib/bundle/wider_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

#include "calib/bundle/gauge.h"
#include "calib/distributions.h"

namespace dtr::calib {
namespace {

// Of columns of length 1: what is left of one that the other unknowns do not make as well.
constexpr double kDependent = 1e-6;

// The unknowns that the observations of one point depend on, in the order of their first use.
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

// Normal equations of everything but the points: lenses and poses as the covariance has them, then
// the extra unknowns, then the residuals themselves as a last column.
class Normal {
 public:
  Normal(const Bundle& bundle, const BundleCovariance& layout, long extra,
         const ExtraColumns& columns)
      : bundle_(bundle),
        layout_(layout),
        of_extra_(columns),
        n_(Normalised::Around(bundle)),
        base_(layout.image_at.back() + 6),
        extra_(extra) {
    matrix_.setZero(base_ + extra_ + 1, base_ + extra_ + 1);
  }

  void AddPoint(const std::vector<const BundleObservation*>& observations) {
    Columns columns;
    std::vector<std::vector<std::pair<long, Eigen::Vector2d>>> rows;
    std::vector<Eigen::Matrix<double, 2, 3>> by_point;
    for (const BundleObservation* observation : observations) {
      ObservationRows seen;
      if (!RowsOf(n_, bundle_, *observation, seen)) continue;
      rows.push_back(RestOf(*observation, seen, columns));
      by_point.push_back(seen.point);
    }
    const auto height = 2 * static_cast<long>(rows.size());
    if (height < 4) return;  // one observation says nothing about anything but its point
    Eigen::MatrixXd points(height, 3);
    Eigen::MatrixXd rest =
        Eigen::MatrixXd::Zero(height, static_cast<long>(columns.unknowns().size()));
    for (size_t i = 0; i < rows.size(); ++i) {
      const auto at = 2 * static_cast<long>(i);
      points.middleRows<2>(at) = by_point[i];
      for (const auto& [column, by] : rows[i]) rest.block<2, 1>(at, column) = by;
    }
    Add(WithoutPoint(points, rest), columns.unknowns());
    coordinates_ += static_cast<int>(height);
  }

  // What lenses and poses leave of the extra unknowns and the residuals: their normal equations
  // without them. The gauge's directions, which nothing determines, are held.
  Eigen::MatrixXd WithoutBase() {
    const Eigen::MatrixXd open = GaugeDirections(n_.poses, layout_.image_at, base_);
    gauge_ = open.cols();
    Eigen::MatrixXd closed = matrix_.topLeftCorner(base_, base_);
    closed += closed.trace() / static_cast<double>(base_) * open * open.transpose();
    const Eigen::VectorXd scale = closed.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd right = scale.asDiagonal() * matrix_.topRightCorner(base_, extra_ + 1);
    const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * closed * scale.asDiagonal());
    return matrix_.bottomRightCorner(extra_ + 1, extra_ + 1) -
           right.transpose() * ldlt.solve(right);
  }

  // One over what each extra unknown does to the residuals before anything else is fitted.
  Eigen::VectorXd UnitsOfExtra() const {
    return matrix_.diagonal().segment(base_, extra_).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  }
  // Numbers that are left when points, lenses and poses are fitted; known after WithoutBase.
  double Free() const { return rows_ - static_cast<double>(base_ - gauge_); }
  int coordinates() const { return coordinates_; }

 private:
  std::vector<std::pair<long, Eigen::Vector2d>> RestOf(const BundleObservation& observation,
                                                       const ObservationRows& seen,
                                                       Columns& columns) const {
    const auto image = static_cast<size_t>(observation.image);
    const auto lens = static_cast<size_t>(bundle_.images[image].lens);
    std::vector<std::pair<long, Eigen::Vector2d>> rest;
    const auto& free = layout_.free_params[lens];
    for (size_t k = 0; k < free.size(); ++k) {
      rest.emplace_back(columns.Of(layout_.lens_at[lens] + static_cast<long>(k)),
                        seen.lens.col(free[k]));
    }
    for (long k = 0; k < 6; ++k) {
      rest.emplace_back(columns.Of(layout_.image_at[image] + k), seen.pose.col(k));
    }
    for (const ExtraColumn& column : of_extra_(observation, seen)) {
      rest.emplace_back(columns.Of(base_ + column.unknown), column.by);
    }
    rest.emplace_back(columns.Of(base_ + extra_), seen.residual);
    return rest;
  }

  void Add(const Eigen::MatrixXd& left, const std::vector<long>& unknowns) {
    const Eigen::MatrixXd product = left.transpose() * left;
    for (size_t i = 0; i < unknowns.size(); ++i) {
      for (size_t j = 0; j < unknowns.size(); ++j) {
        matrix_(unknowns[i], unknowns[j]) += product(static_cast<long>(i), static_cast<long>(j));
      }
    }
    rows_ += static_cast<double>(left.rows());
  }

  const Bundle& bundle_;
  const BundleCovariance& layout_;
  const ExtraColumns& of_extra_;
  const Normalised n_;
  const long base_, extra_;
  Eigen::MatrixXd matrix_;
  double rows_ = 0;  // that are left when the points are fitted
  long gauge_ = 0;
  int coordinates_ = 0;
};

WiderFit FitFrom(const Eigen::MatrixXd& left, const Eigen::VectorXd& units, double free,
                 int coordinates) {
  WiderFit fit;
  const long extra = units.size();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      units.asDiagonal() * left.topLeftCorner(extra, extra) * units.asDiagonal());
  const Eigen::VectorXd along =
      eigen.eigenvectors().transpose() * (units.asDiagonal() * left.topRightCorner(extra, 1));
  double explained = 0;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(extra);
  for (long k = 0; k < extra; ++k) {
    const double value = eigen.eigenvalues()[k];
    if (!(value > kDependent)) continue;
    inverse[k] = 1 / value;
    explained += along[k] * along[k] / value;
    ++fit.freedom;
  }
  const double below = free - fit.freedom;
  if (fit.freedom == 0 || !(below > 0)) {
    fit.not_tested = "the observations do not separate it from the other unknowns";
    return fit;
  }
  // Of exact observations rounding is left, which may as well come out below zero.
  const double unexplained = std::max(0.0, left(extra, extra) - explained);
  const double variance = std::max(unexplained / below, kPrecisionPx * kPrecisionPx);
  fit.p = FisherSurvival(explained / fit.freedom / variance, fit.freedom, below);
  fit.amplitude_px = RootOfVariance((explained - fit.freedom * variance) / coordinates);
  const Eigen::VectorXd roots = inverse.cwiseSqrt();
  const Eigen::MatrixXd half = units.asDiagonal() * eigen.eigenvectors() * roots.asDiagonal();
  fit.found = -half * (roots.asDiagonal() * along);
  fit.half = std::sqrt(variance) * half;
  return fit;
}

}  // namespace

WiderFit FitWider(const Adjusted& adjusted, const BundleCovariance& layout, long extra,
                  const ExtraColumns& columns) {
  const Bundle& bundle = adjusted.bundle;
  if (extra > MostExtra(layout)) {
    WiderFit fit;
    fit.not_tested = "more unknowns than are worked out at once";
    return fit;
  }
  Normal normal(bundle, layout, extra, columns);
  std::vector<std::vector<const BundleObservation*>> tracks(bundle.points.size());
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (!adjusted.used[i]) continue;
    tracks[static_cast<size_t>(bundle.observations[i].point)].push_back(&bundle.observations[i]);
  }
  for (const auto& observations : tracks) normal.AddPoint(observations);
  const Eigen::MatrixXd left = normal.WithoutBase();
  return FitFrom(left, normal.UnitsOfExtra(), normal.Free(), normal.coordinates());
}

long MostExtra(const BundleCovariance& layout) {
  return kMaxUnknowns - (layout.image_at.back() + 6);
}

Eigen::Vector2d DrawnAt(const BundleObservation& observation, const ObservationRows& rows) {
  return observation.pixel + rows.residual;
}

}  // namespace dtr::calib
