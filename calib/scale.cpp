#include "calib/scale.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/similarity.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr double kMaxDisagreement = 5;  // sigmas
constexpr int kMaxPasses = 20;
constexpr double kRoundingShare = 1e-12;  // share of what is known best: rounding

double RelativeSigma(const MeasuredDistance& d) {
  const Eigen::Vector3d way = d.b - d.a;
  const double length = way.norm();
  const Eigen::Vector3d along = way / length;
  const double variance = along.dot((d.covariance_a + d.covariance_b) * along);
  const double measured = d.sigma_m > 0 ? d.sigma_m / d.length_m : kUnstatedRelativeSigma;
  return std::hypot(std::sqrt(variance) / length, measured);
}

double RmsFromMean(std::span<const Eigen::Vector3d> points) {
  const Eigen::Vector3d mean = MeanOf(points);
  double squares = 0;
  for (const Eigen::Vector3d& p : points) squares += (p - mean).squaredNorm();
  return std::sqrt(squares / static_cast<double>(points.size()));
}

}  // namespace

void FillUncertainty(std::span<const Eigen::Vector3d> centres,
                     std::span<const Eigen::Vector3d> sigmas_m, PositionScale& scale) {
  const Eigen::Vector3d mean = MeanOf(centres);
  // Of a shift, a turn and the scale's logarithm.
  Eigen::Matrix<double, 7, 7> information = Eigen::Matrix<double, 7, 7>::Zero();
  for (size_t i = 0; i < centres.size(); ++i) {
    const Eigen::Vector3d arm = scale.metric_from_scene.scale * (centres[i] - mean);
    Eigen::Matrix<double, 3, 7> moved;
    moved.leftCols<3>().setIdentity();
    moved.middleCols<3>(3) << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
    moved.col(6) = arm;
    const Eigen::Vector3d weights = sigmas_m[i].array().square().inverse();
    information += moved.transpose() * weights.asDiagonal() * moved;
  }
  // What the shift takes up, then what the turn does: it may be unknown, which leaves the scale.
  const Eigen::Matrix4d rest =
      information.bottomRightCorner<4, 4>() -
      information.bottomLeftCorner<4, 3>() *
          information.topLeftCorner<3, 3>().ldlt().solve(information.topRightCorner<3, 4>());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turn(rest.topLeftCorner<3, 3>());
  double known_scale = rest(3, 3);
  for (int k = 0; k < 3; ++k) {
    const double known = turn.eigenvalues()[k];
    if (!(known > kRoundingShare * turn.eigenvalues()[2])) continue;
    known_scale -= std::pow(turn.eigenvectors().col(k).dot(rest.topRightCorner<3, 1>()), 2) / known;
  }
  scale.relative_sigma = 1 / std::sqrt(std::max(known_scale, 0.0));
  // The turn where the scale is adjusted, too.
  const Eigen::Vector3d both = rest.topRightCorner<3, 1>();
  const Eigen::Matrix3d alone = rest.topLeftCorner<3, 3>() - both * both.transpose() / rest(3, 3);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> worst(alone, Eigen::EigenvaluesOnly);
  scale.turn_sigma_rad = 1 / std::sqrt(std::max(worst.eigenvalues()[0], 0.0));
}

DistanceScale ScaleFromDistances(std::span<const MeasuredDistance> distances) {
  if (distances.empty()) throw Error("scale: expected a measured distance, found none");
  std::vector<double> scales, sigmas;
  double weights = 0, mean = 0;
  for (const MeasuredDistance& d : distances) {
    const double length = (d.b - d.a).norm();
    const double relative = length > 0 ? RelativeSigma(d) : std::numeric_limits<double>::infinity();
    if (!(relative <= kMaxRelativeSigma)) {
      throw Error(fmt::format(
          "{}: expected points whose distance is known to 10 %, found {:.4g} +- {:.2g} units; take "
          "points farther apart, or click each of them in more views",
          d.name, length, length > 0 ? relative * length : 0));
    }
    scales.push_back(d.length_m / length);
    // The smallest error anybody can claim keeps the weights finite.
    sigmas.push_back(std::max(relative, 1e-12));
    const double weight = 1 / (sigmas.back() * sigmas.back());
    weights += weight;
    mean += weight * std::log(scales.back());
  }
  mean /= weights;
  DistanceScale scale;
  scale.metres_per_unit = distances.size() == 1 ? scales[0] : std::exp(mean);
  double squares = 0;
  for (size_t i = 0; i < scales.size(); ++i) {
    const double off = (std::log(scales[i]) - mean) / sigmas[i];
    // What the mean itself errs with it is not held against it.
    const double own = std::max(1 - 1 / (sigmas[i] * sigmas[i] * weights), 1e-9);
    scale.sigmas.push_back(distances.size() == 1 ? 0 : std::abs(off) / std::sqrt(own));
    squares += off * off;
  }
  const auto worst = std::max_element(scale.sigmas.begin(), scale.sigmas.end());
  if (*worst > kMaxDisagreement) {
    const auto i = static_cast<size_t>(worst - scale.sigmas.begin());
    throw Error(fmt::format(
        "{}: expected distances that agree, found {:.5g} m per unit here and {:.5g} in all, {:.1f} "
        "standard deviations apart; is it the right pair of points?",
        distances[i].name, scales[i], scale.metres_per_unit, *worst));
  }
  scale.relative_sigma = 1 / std::sqrt(weights);
  if (scales.size() > 1) {
    scale.relative_sigma *=
        std::max(1.0, std::sqrt(squares / static_cast<double>(scales.size() - 1)));
  }
  return scale;
}

Eigen::Vector3d EarthFromGeodetic(double latitude_deg, double longitude_deg, double height_m) {
  constexpr double kRadius = 6378137, kFlattening = 1 / 298.257223563;  // WGS 84
  constexpr double kDegree = std::numbers::pi / 180;
  constexpr double kSquare = kFlattening * (2 - kFlattening);
  const double latitude = latitude_deg * kDegree, longitude = longitude_deg * kDegree;
  const double normal = kRadius / std::sqrt(1 - kSquare * std::pow(std::sin(latitude), 2));
  const double out = (normal + height_m) * std::cos(latitude);
  return {out * std::cos(longitude), out * std::sin(longitude),
          (normal * (1 - kSquare) + height_m) * std::sin(latitude)};
}

Eigen::Matrix3d EnuFromEarth(double latitude_deg, double longitude_deg) {
  constexpr double kDegree = std::numbers::pi / 180;
  const double sin_lat = std::sin(latitude_deg * kDegree),
               cos_lat = std::cos(latitude_deg * kDegree);
  const double sin_lon = std::sin(longitude_deg * kDegree),
               cos_lon = std::cos(longitude_deg * kDegree);
  Eigen::Matrix3d axes;
  axes << -sin_lon, cos_lon, 0,                         //
      -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat,  //
      cos_lat * cos_lon, cos_lat * sin_lon, sin_lat;
  return axes;
}

double SigmaOfRadius(double radius_m) {
  constexpr double kShare = 0.68;  // of the errors, that Android's documentation says lie within
  return radius_m / std::sqrt(-2 * std::log(1 - kShare));
}

PositionScale AlignToPositions(std::span<const Eigen::Vector3d> centres,
                               std::span<const Eigen::Vector3d> positions_m,
                               std::optional<double> known_scale) {
  if (centres.size() != positions_m.size() || centres.size() < kMinPositions) {
    throw Error(fmt::format("scale: expected at least {} positions, found {}", kMinPositions,
                            std::min(centres.size(), positions_m.size())));
  }
  PositionScale scale;
  std::vector<bool> used, next(centres.size(), true);
  std::vector<Eigen::Vector3d> a, b;
  scale.settled = false;
  for (int pass = 0; !scale.settled && pass < kMaxPasses; ++pass) {
    used = next;
    a.clear();
    b.clear();
    for (size_t i = 0; i < centres.size(); ++i) {
      if (!used[i]) continue;
      a.push_back(centres[i]);
      b.push_back(positions_m[i]);
    }
    if (a.size() < kMinPositions || 2 * a.size() < centres.size()) {
      throw Error(fmt::format(
          "scale: expected positions that agree with the cameras, found that {} of {} do", a.size(),
          centres.size()));
    }
    scale.metric_from_scene =
        known_scale ? AlignPointsAtScale(a, b, *known_scale) : AlignPoints(a, b);
    std::vector<double> lengths;
    for (size_t i = 0; i < centres.size(); ++i) {
      lengths.push_back((scale.metric_from_scene * centres[i] - positions_m[i]).norm());
    }
    std::vector<double> sorted = lengths;
    // A millionth of the extent: exact positions leave rounding alone. Of the cameras' extent, for
    // one place may lie on another continent.
    const double limit = kPositionOutlierSigmas * UpperMedian(sorted) / kMedianLength +
                         1e-6 * scale.metric_from_scene.scale * RmsFromMean(a);
    for (size_t i = 0; i < lengths.size(); ++i) next[i] = lengths[i] <= limit;
    scale.settled = next == used;
  }
  for (size_t i = 0; i < centres.size(); ++i) {
    if (!used[i]) scale.left_out.push_back(i);
  }
  scale.rms_m = AlignmentRms(scale.metric_from_scene, a, b);
  const double freedom = 3.0 * static_cast<double>(a.size()) - (known_scale ? 6 : 7);
  scale.sigma_m = scale.rms_m * std::sqrt(static_cast<double>(a.size()) / freedom);
  // Positions that are met exactly are known to rounding.
  const double sigma_m =
      std::max(scale.sigma_m, kRoundingShare * scale.metric_from_scene.scale * RmsFromMean(a));
  const std::vector<Eigen::Vector3d> sigmas(a.size(), Eigen::Vector3d::Constant(sigma_m));
  FillUncertainty(a, sigmas, scale);
  return scale;
}

void RequireKnownScale(const PositionScale& scale) {
  if (scale.relative_sigma <= kMaxRelativeSigma) return;
  throw Error(fmt::format(
      "scale: expected a scale known to 10 %, found one to {:.0f} %: positions that err by {:.2g} "
      "m RMS, of cameras that stand too near to each other for that; measure a --distance",
      100 * scale.relative_sigma, scale.rms_m));
}

PositionScale ScaleFromPositions(std::span<const Eigen::Vector3d> centres,
                                 std::span<const Eigen::Vector3d> positions_m) {
  const PositionScale scale = AlignToPositions(centres, positions_m);
  RequireKnownScale(scale);
  return scale;
}

}  // namespace dtr::calib
