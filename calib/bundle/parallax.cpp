#include "calib/bundle/parallax.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/bundle/lens_params.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

// A point whose inverse distance is uncertain by more than this share of the others' median could
// as well be at half their distance, or at infinity.
constexpr double kUnknownShare = 1;
constexpr size_t kMinOthers = 10;      // of an image, for their median to say how far things are
constexpr double kMinKeptShare = 0.5;  // of an image's observations

using Tracks = std::vector<std::vector<size_t>>;  // images that see each point

Tracks TracksOf(const Bundle& bundle, const std::vector<bool>& used) {
  Tracks tracks(bundle.points.size());
  for (size_t i = 0; i < used.size(); ++i) {
    const BundleObservation& o = bundle.observations[i];
    if (used[i]) tracks[static_cast<size_t>(o.point)].push_back(static_cast<size_t>(o.image));
  }
  return tracks;
}

// Standard deviation of a point's inverse distance by its observations, the cameras known.
double RhoSigma(const Bundle& bundle, const Normalised& n, size_t point,
                const std::vector<size_t>& images, double sigma_px) {
  const PointFrame& frame = n.points[point];
  const auto count = static_cast<double>(images.size());
  std::vector<Eigen::Vector3d> across;  // the ray
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double focal_px = 0;
  for (const size_t image : images) {
    const Eigen::Vector3d offset = n.Centre(image) - frame.anchor;
    across.push_back(offset - offset.dot(frame.direction) * frame.direction);
    mean += across.back() / count;
    focal_px += bundle.lenses[static_cast<size_t>(bundle.images[image].lens)].params[0] / count;
  }
  double squares = 0;
  for (const Eigen::Vector3d& offset : across) squares += (offset - mean).squaredNorm();
  return sigma_px / (focal_px * std::sqrt(squares));
}

// Median inverse distance from each image of its points with a sigma below `limits`; 0: too few.
std::vector<double> MedianRhos(const Normalised& n, const Tracks& tracks,
                               const std::vector<double>& sigmas,
                               const std::vector<double>& limits) {
  std::vector<std::vector<double>> rhos(n.poses.size());
  for (size_t p = 0; p < tracks.size(); ++p) {
    const Eigen::Vector4d place = n.Place(p);
    for (const size_t image : tracks[p]) {
      if (!(sigmas[p] < limits[image])) continue;
      rhos[image].push_back(std::abs(place[3]) /
                            (place.head<3>() - place[3] * n.Centre(image)).norm());
    }
  }
  std::vector<double> medians;
  for (auto& of_image : rhos) {
    medians.push_back(of_image.size() < kMinOthers ? 0 : UpperMedian(of_image));
  }
  return medians;
}

}  // namespace

void LeaveOutWithoutParallax(const Bundle& bundle, const Normalised& n, double sigma_px,
                             std::vector<bool>& used) {
  const Tracks tracks = TracksOf(bundle, used);
  std::vector<double> sigmas;
  for (size_t p = 0; p < tracks.size(); ++p) {
    sigmas.push_back(RhoSigma(bundle, n, p, tracks[p], sigma_px));
  }
  // The points that decide how far things are pass by that very measure.
  const double none = std::numeric_limits<double>::infinity();
  std::vector<double> limits =
      MedianRhos(n, tracks, sigmas, std::vector<double>(n.poses.size(), none));
  for (double& limit : limits) limit *= kUnknownShare;
  limits = MedianRhos(n, tracks, sigmas, limits);
  std::vector<size_t> seen(n.poses.size()), kept(n.poses.size());
  std::vector<bool> unknown(tracks.size());
  for (size_t p = 0; p < tracks.size(); ++p) {
    if (tracks[p].size() < 2) continue;
    const double rho = limits[tracks[p].front()];
    unknown[p] = rho > 0 && !(sigmas[p] < kUnknownShare * rho);
    for (const size_t image : tracks[p]) ++seen[image], kept[image] += !unknown[p];
  }
  for (size_t i = 0; i < used.size(); ++i) {
    const BundleObservation& o = bundle.observations[i];
    if (!used[i] || !unknown[static_cast<size_t>(o.point)]) continue;
    const std::vector<size_t>& images = tracks[static_cast<size_t>(o.point)];
    used[i] = std::any_of(images.begin(), images.end(), [&](size_t image) {
      return static_cast<double>(kept[image]) < kMinKeptShare * static_cast<double>(seen[image]);
    });
  }
}

}  // namespace dtr::calib
