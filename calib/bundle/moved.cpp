#include "calib/bundle/moved.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/bundle/gauge.h"
#include "calib/bundle/observation_rows.h"

namespace dtr::calib {
namespace {

constexpr int kReweightings = 20;
constexpr double kMinPx = 1e-3;  // images that move less count alike

using Gauge = Eigen::Matrix<double, 7, 1>;

struct MovedObservation {
  size_t image;
  Eigen::Vector2d by_px;
  Eigen::Matrix<double, 2, 7> by_gauge;
};

Bundle WithCameras(const Bundle& fresh, const Bundle& other_cameras) {
  Bundle other = fresh;
  other.lenses = other_cameras.lenses;
  other.images = other_cameras.images;
  return other;
}

std::vector<MovedObservation> ObservationsOf(const Adjusted& solved, const Bundle& other) {
  const auto fresh = Residuals(solved.bundle);
  const Normalised n = Normalised::Around(other);
  const Eigen::MatrixXd of_poses = GaugeColumns(n.poses);
  std::vector<MovedObservation> observations;
  for (size_t i = 0; i < fresh.size(); ++i) {
    ObservationRows rows;
    const BundleObservation& o = other.observations[i];
    if (!solved.used[i] || !fresh[i].allFinite() || !RowsOf(n, other, o, rows)) continue;
    observations.push_back({static_cast<size_t>(o.image), rows.residual - fresh[i],
                            rows.pose * of_poses.middleRows<6>(6L * o.image)});
  }
  return observations;
}

std::vector<double> RmsOf(const std::vector<MovedObservation>& observations, size_t images,
                          const Gauge& g) {
  std::vector<double> squared(images), count(images);
  for (const MovedObservation& observation : observations) {
    squared[observation.image] += (observation.by_px + observation.by_gauge * g).squaredNorm();
    count[observation.image] += 1;
  }
  for (size_t i = 0; i < images; ++i) {
    squared[i] =
        count[i] > 0 ? std::sqrt(squared[i] / count[i]) : std::numeric_limits<double>::quiet_NaN();
  }
  return squared;
}

}  // namespace

std::vector<double> MovedPx(const Adjusted& solved, const Bundle& other_cameras) {
  const Bundle other = WithCameras(solved.bundle, other_cameras);
  return RmsOf(ObservationsOf(solved, other), other.images.size(), Gauge::Zero());
}

std::vector<double> MovedPxInNearestWorld(const Adjusted& solved, const Bundle& other_cameras) {
  const Bundle other = WithCameras(solved.bundle, other_cameras);
  const std::vector<MovedObservation> observations = ObservationsOf(solved, other);
  std::vector<double> count(other.images.size());
  for (const MovedObservation& observation : observations) count[observation.image] += 1;
  Gauge g = Gauge::Zero();
  for (int k = 0; k < kReweightings; ++k) {
    const std::vector<double> rms = RmsOf(observations, other.images.size(), g);
    Eigen::Matrix<double, 7, 7> normal = Eigen::Matrix<double, 7, 7>::Zero();
    Gauge right = Gauge::Zero();
    for (const MovedObservation& observation : observations) {
      const double weight =
          1 / (count[observation.image] * std::max(rms[observation.image], kMinPx));
      normal += weight * observation.by_gauge.transpose() * observation.by_gauge;
      right += weight * observation.by_gauge.transpose() * observation.by_px;
    }
    const Gauge next = -normal.completeOrthogonalDecomposition().solve(right);
    if (!next.allFinite()) break;
    g = next;
  }
  return RmsOf(observations, other.images.size(), g);
}

}  // namespace dtr::calib
