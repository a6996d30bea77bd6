#include "calib/validation/image_shift.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/distributions.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

constexpr double kNoShift = std::numeric_limits<double>::quiet_NaN();
constexpr int kPointsPerView = 40;  // that its image's shift is worked out at

// Observations of each image, by index, of points that are places.
std::vector<std::vector<int>> ObservationsByImage(const Adjusted& fresh) {
  std::vector<std::vector<int>> observations(fresh.bundle.images.size());
  for (size_t i = 0; i < fresh.bundle.observations.size(); ++i) {
    const BundleObservation& o = fresh.bundle.observations[i];
    if (fresh.used[i] && fresh.bundle.points[static_cast<size_t>(o.point)][3] > 0) {
      observations[static_cast<size_t>(o.image)].push_back(static_cast<int>(i));
    }
  }
  return observations;
}

// An image's points, and the standard deviation (px per axis) of where the two images that share
// most points with it place them.
std::vector<PlacedPixel> Placed(const Adjusted& fresh, const BundleCovariance& covariance,
                                const std::vector<std::vector<int>>& observations,
                                const std::vector<std::vector<int>>& seen_by, int image) {
  const auto& own = observations[static_cast<size_t>(image)];
  std::map<int, int> shared;
  for (const int i : own) {
    const auto point = static_cast<size_t>(fresh.bundle.observations[static_cast<size_t>(i)].point);
    for (const int other : seen_by[point]) shared[other] += other != image;
  }
  std::vector<std::pair<int, int>> ranked;  // -shared points, image
  for (const auto& [other, times] : shared) {
    if (other != image && times > 0) ranked.emplace_back(-times, other);
  }
  if (ranked.size() < 2) return {};
  std::sort(ranked.begin(), ranked.end());
  const int a = ranked[0].second, b = ranked[1].second;
  const auto step = std::max<size_t>(1, own.size() / kPointsPerView);
  std::vector<PlacedPixel> placed;
  for (size_t k = 0; k < own.size(); k += step) {
    const auto& o = fresh.bundle.observations[static_cast<size_t>(own[k])];
    const Eigen::Vector4d& h = fresh.bundle.points[static_cast<size_t>(o.point)];
    const Eigen::Matrix2d variance =
        TransferCovariance(fresh.bundle, covariance, h.head<3>() / h[3], a, b, image);
    if (!variance.allFinite()) continue;
    placed.push_back({o.pixel, RootOfVariance(variance.trace() / 2)});
  }
  return placed;
}

// 95 % of their standard deviations.
double ImageShift(const std::vector<PlacedPixel>& placed) {
  if (placed.empty()) return kNoShift;
  std::vector<double> shifts;
  for (const PlacedPixel& point : placed) shifts.push_back(point.sigma_px);
  std::sort(shifts.begin(), shifts.end());
  return shifts[static_cast<size_t>(0.95 * static_cast<double>(shifts.size() - 1))];
}

}  // namespace

void ImageShifts(const Adjusted& fresh, const BundleCovariance& covariance,
                 std::vector<PhotoValidation>& cameras) {
  const auto observations = ObservationsByImage(fresh);
  std::vector<std::vector<int>> seen_by(fresh.bundle.points.size());
  for (size_t i = 0; i < observations.size(); ++i) {
    for (const int s : observations[i]) {
      const auto point =
          static_cast<size_t>(fresh.bundle.observations[static_cast<size_t>(s)].point);
      seen_by[point].push_back(static_cast<int>(i));
    }
  }
  ParallelFor(0, static_cast<int>(observations.size()), [&](int i) {
    PhotoValidation& camera = cameras[static_cast<size_t>(i)];
    camera.placed = Placed(fresh, covariance, observations, seen_by, i);
    camera.image_shift_px = ImageShift(camera.placed);
  });
}

}  // namespace dtr::calib
