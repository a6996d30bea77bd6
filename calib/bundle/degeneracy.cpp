#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "calib/bundle/judge.h"
#include "calib/bundle/lens_params.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

// An inverse distance that is not this many standard deviations from zero is no distance.
constexpr double kSeesDistance = 4;
constexpr double kSmallAngleDeg = 1;       // COLMAP's stereo rejects below 1 degree
constexpr double kCollinear = 0.01;        // second over first extent of the centres, or points
constexpr double kPlanar = 0.03;           // third over second extent of the points
constexpr double kForwardDeg = 20;         // between the way and the axis
constexpr double kMaxTracksOfTwo = 0.9;    // share of points
constexpr double kSameObservations = 0.9;  // share of a photo's observations that another repeats
constexpr double kSamePx = 0.01;

struct Geometry {
  std::vector<Eigen::Vector3d> centres, axes;
  std::vector<std::vector<const BundleObservation*>> tracks;
};

Geometry GeometryOf(const Adjusted& adjusted) {
  Geometry g;
  const Bundle& bundle = adjusted.bundle;
  for (const BundleImage& image : bundle.images) {
    g.centres.push_back(image.cam_from_world.TargetOriginInSource());
    g.axes.push_back(image.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ());
  }
  g.tracks.resize(bundle.points.size());
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    const BundleObservation& o = bundle.observations[i];
    if (adjusted.used[i]) g.tracks[static_cast<size_t>(o.point)].push_back(&o);
  }
  std::erase_if(g.tracks, [](const auto& track) { return track.size() < 2; });
  return g;
}

double Median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  return UpperMedian(values);
}

// Singular values of points about their mean: extents along their principal axes.
Eigen::Vector3d Extents(const std::vector<Eigen::Vector3d>& points, Eigen::Vector3d* first_axis) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  *first_axis = eigen.eigenvectors().col(2);
  return eigen.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
}

struct Parallax {
  double median_angle_deg = 0;     // widest angle between two rays of a point
  double median_significance = 0;  // inverse distance over its standard deviation, cameras known
};

// The widest parallax angle t of a point tells its distance by t / (sigma / f), roughly.
Parallax ParallaxOf(const Adjusted& adjusted, const Geometry& g) {
  const Bundle& bundle = adjusted.bundle;
  std::vector<double> angles, significances;
  for (const auto& track : g.tracks) {
    const Eigen::Vector4d& h = bundle.points[static_cast<size_t>(track.front()->point)];
    double widest = 0;
    for (const auto* a : track) {
      for (const auto* b : track) {
        const Eigen::Vector3d u = h.head<3>() - h[3] * g.centres[static_cast<size_t>(a->image)];
        const Eigen::Vector3d v = h.head<3>() - h[3] * g.centres[static_cast<size_t>(b->image)];
        widest = std::max(widest, std::atan2(u.cross(v).norm(), u.dot(v)));
      }
    }
    const auto lens =
        static_cast<size_t>(bundle.images[static_cast<size_t>(track.front()->image)].lens);
    const double ray_sigma =
        std::max(adjusted.sigma_px, kPrecisionPx) / bundle.lenses[lens].params[0];
    angles.push_back(widest * 180 / std::numbers::pi);
    significances.push_back(widest / (std::numbers::sqrt2 * ray_sigma));
  }
  return {Median(std::move(angles)), Median(std::move(significances))};
}

std::string DuplicateImages(const Adjusted& adjusted) {
  const Bundle& bundle = adjusted.bundle;
  std::map<std::pair<int, int>, int> same;
  std::vector<int> count(bundle.images.size());
  const auto& all = bundle.observations;
  for (size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && all[end].point == all[begin].point) ++end;
    for (size_t i = begin; i < end; ++i) {
      ++count[static_cast<size_t>(all[i].image)];
      for (size_t j = begin; j < i; ++j) {
        same[{all[j].image, all[i].image}] += (all[i].pixel - all[j].pixel).norm() < kSamePx;
      }
    }
  }
  std::string names;
  for (const auto& [pair, times] : same) {
    const int least =
        std::min(count[static_cast<size_t>(pair.first)], count[static_cast<size_t>(pair.second)]);
    if (least < 10 || times < kSameObservations * least) continue;
    names += fmt::format("{}{} = {}", names.empty() ? "" : ", ",
                         bundle.images[static_cast<size_t>(pair.first)].name,
                         bundle.images[static_cast<size_t>(pair.second)].name);
  }
  return names;
}

// A focal length whose uncertainty leaves it of no use; empty where there is none.
std::string UselessFocal(const Adjusted& adjusted, const BundleCovariance& covariance,
                         double max_share) {
  for (size_t i = 0; i < adjusted.bundle.lenses.size(); ++i) {
    if (covariance.free_params[i].empty()) continue;
    const Eigen::MatrixXd of_lens = covariance.OfLens(adjusted.bundle, static_cast<int>(i));
    const double f = adjusted.bundle.lenses[i].params[0], sigma = std::sqrt(of_lens(0, 0));
    if (!(sigma <= max_share * f)) {
      return fmt::format("focal length {:.4g} px +- {:.2g} of camera {}", f, sigma, i + 1);
    }
  }
  return "";
}

}  // namespace

std::vector<Degeneracy> FindDegeneracies(const Adjusted& adjusted,
                                         const BundleCovariance& covariance,
                                         double max_focal_share) {
  std::vector<Degeneracy> found;
  const Bundle& bundle = adjusted.bundle;
  const Geometry g = GeometryOf(adjusted);
  const std::string duplicates = DuplicateImages(adjusted);
  if (!duplicates.empty()) found.push_back({"duplicate_images", duplicates, true});
  if (bundle.images.size() < 3) {
    found.push_back({"too_few_views",
                     fmt::format("{} images: nothing can be held out", bundle.images.size()),
                     true});
  }
  if (g.tracks.empty()) return found;
  // Is anything left undetermined? What follows says why, and is harmless where nothing is.
  std::string undetermined;
  if (covariance.computed && !covariance.determined) {
    undetermined = covariance.weakest + " is not determined";
  } else if (covariance.computed) {
    undetermined = UselessFocal(adjusted, covariance, max_focal_share);
  }
  const Parallax parallax = ParallaxOf(adjusted, g);
  const bool no_distance = !(parallax.median_significance >= kSeesDistance);
  const bool harmful = !undetermined.empty() || no_distance;
  const size_t before = found.size();
  const auto add = [&](const char* name, std::string detail, bool harm) {
    if (!undetermined.empty()) detail += "; " + undetermined;
    found.push_back({name, std::move(detail), harm});
  };
  if (no_distance) {
    add("pure_rotation",
        fmt::format("half the points have a parallax of less than {:.1f} standard deviations: the "
                    "cameras rotate in one position, or everything is far away",
                    parallax.median_significance),
        true);
  } else if (parallax.median_angle_deg < kSmallAngleDeg) {
    add("small_angles",
        fmt::format("half the points are seen under less than {:.2g} degrees",
                    parallax.median_angle_deg),
        harmful);
  }
  Eigen::Vector3d way, unused;
  const Eigen::Vector3d extent = Extents(g.centres, &way);
  if (!no_distance && bundle.images.size() >= 3 && extent[1] < kCollinear * extent[0]) {
    std::vector<double> off_axis;
    for (const auto& axis : g.axes) {
      off_axis.push_back(std::acos(std::min(1.0, std::abs(axis.dot(way)))) * 180 /
                         std::numbers::pi);
    }
    const double angle = Median(std::move(off_axis));
    if (angle < kForwardDeg) {
      add("forward_motion",
          fmt::format("the cameras move along their axes, to {:.0f} degrees", angle), harmful);
    } else {
      add("collinear_centres",
          fmt::format("the cameras stand on a line, to {:.2g} of its length",
                      extent[1] / extent[0]),
          harmful);
    }
  }
  std::vector<Eigen::Vector3d> places;
  for (const Eigen::Vector4d& h : bundle.points) {
    if (h[3] > 0) places.push_back(h.head<3>() / h[3]);
  }
  if (!no_distance && places.size() >= 4) {
    const Eigen::Vector3d flat = Extents(places, &unused);
    if (flat[1] < kCollinear * flat[0]) {
      add("collinear_points",
          fmt::format(
              "the points lie on a line, to {:.2g} of its length: cameras may rotate about it",
              flat[1] / flat[0]),
          harmful);
    } else if (flat[2] < kPlanar * flat[1]) {
      add("planar_scene",
          fmt::format("the points lie in a plane, to {:.2g} of its extent", flat[2] / flat[1]),
          harmful);
    }
  }
  const auto twos = std::count_if(g.tracks.begin(), g.tracks.end(),
                                  [](const auto& track) { return track.size() == 2; });
  const double share = static_cast<double>(twos) / static_cast<double>(g.tracks.size());
  if (share > kMaxTracksOfTwo) {
    add("tracks_of_two",
        fmt::format("{:.0f} % of the points are seen by two images only", 100 * share), harmful);
  }
  if (!undetermined.empty() && found.size() == before) {
    found.push_back({"undetermined", undetermined, true});
  }
  return found;
}

}  // namespace dtr::calib
