#include "calib/sfm/matching/pair_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/sfm/matching/pair_kind.h"
#include "calib/sfm/matching/robust_fit.h"
#include "calib/sfm/matching/vote_cameras.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr int kFewestMatches = 15;     // COLMAP's min_num_inliers
constexpr double kFarthestSlope = 11;  // tangent of 85 degrees

struct RayMatches {
  PointPairs points;
  FeatureMatches matches;
};

// The matches both of whose features have a ray.
RayMatches WithRays(const RayFeatures& a, const RayFeatures& b, const FeatureMatches& matches) {
  RayMatches chosen;
  for (const auto& [i, j] : matches) {
    if (!a.points[i].allFinite() || !b.points[j].allFinite()) continue;
    chosen.points.Add(a.points[i], b.points[j]);
    chosen.matches.emplace_back(i, j);
  }
  return chosen;
}

// The matches that agree with a fundamental matrix fitted again to those along its lines.
std::optional<PairGeometry> WithoutFocal(const RayMatches& guided, Eigen::Matrix3d m, double band) {
  for (int k = 0; k < 3; ++k) {
    std::vector<double> weights(guided.points.size(), 0);
    for (size_t i = 0; i < weights.size(); ++i) {
      const double s = SampsonSquared(m, guided.points.a[i], guided.points.b[i]) / (band * band);
      if (s < 1) weights[i] = (1 - s) * (1 - s);
    }
    const auto next = FundamentalFromMany(guided.points, weights);
    if (!next) return std::nullopt;
    m = *next;
  }
  PairGeometry pair;
  for (const int i : EpipolarInliers(m, guided.points, band)) {
    pair.matches.push_back(guided.matches[static_cast<size_t>(i)]);
  }
  if (static_cast<int>(pair.matches.size()) < kFewestMatches) return std::nullopt;
  return pair;
}

// All features along the lines of a pose, and the pose refined on them.
struct Guided {
  RayMatches matches;
  RelativePose pose;
  size_t within = 0, near = 0;  // matches within the band, and within a quarter of it
  double NearShare() const {
    return within > 0 ? static_cast<double>(near) / static_cast<double>(within) : 0;
  }
};

Guided Along(const RayFeatures& a, const RayFeatures& b, const RelativePose& pose, double band) {
  Guided guided;
  guided.matches = WithRays(a, b, GuidedMatches(a.grid, b.grid, pose.Essential(), b.band));
  const PointPairs& points = guided.matches.points;
  guided.pose = RefinePose(RefinePose(pose, points, band / 2, 6), points, band / 4, 6);
  const Eigen::Matrix3d essential = guided.pose.Essential();
  guided.within = EpipolarInliers(essential, points, band).size();
  guided.near = EpipolarInliers(essential, points, band / 4).size();
  return guided;
}

// Right matches lie close to their lines, those by chance anywhere in the band: a pose whose
// matches spread is fitted again to the closest of the coarse ones, and given up where matches
// still do. On plaza 0.48 to 0.64 were near of poses wrong by more than 2 degrees, 0.66 and more
// of all but a few of the others.
std::optional<Guided> GuidedOf(const RayFeatures& a, const RayFeatures& b, const PointPairs& coarse,
                               const RelativePose& start, double band, std::uint64_t seed) {
  constexpr double kSurelyNear = 0.75, kLeastNear = 0.62;
  Guided best = Along(a, b, start, band);
  for (int k = 0; k < 2 && best.NearShare() < kSurelyNear; ++k) {
    const auto fit = FitEssential(coarse, band / (k == 0 ? 3 : 6), HashOf(seed, k));
    if (!fit || static_cast<int>(fit->inliers.size()) < kFewestMatches) break;
    Guided other = Along(a, b, fit->pose, band);
    if (other.near > best.near) best = std::move(other);
  }
  if (best.NearShare() < kLeastNear) return std::nullopt;
  return best;
}

// The matches that agree with a pose, their points in front of both cameras.
std::optional<PairGeometry> WithFocal(const Guided& guided, double band, std::uint64_t seed) {
  const RelativePose& pose = guided.pose;
  const PointPairs& points = guided.matches.points;
  PairGeometry pair;
  PointPairs inliers;
  for (const int k : EpipolarInliers(pose.Essential(), points, band)) {
    const auto i = static_cast<size_t>(k);
    const auto depths = DepthsOf(pose, points.a[i], points.b[i]);
    // Points too far away for their parallax to tell may seem to lie behind.
    const Eigen::Vector3d p = (pose.r * points.a[i].homogeneous()).normalized();
    const Eigen::Vector3d q = points.b[i].homogeneous().normalized();
    const bool far = p.cross(q).norm() < 2 * band && p.dot(q) > 0;
    if (!far && !(depths && depths->x() > 0 && depths->y() > 0)) continue;
    pair.matches.push_back(guided.matches.matches[i]);
    inliers.Add(points.a[i], points.b[i]);
  }
  if (static_cast<int>(pair.matches.size()) < kFewestMatches) return std::nullopt;
  ClassifyPair(pose, inliers, band, seed, pair);
  return pair;
}

}  // namespace

RayFeatures RaysOf(const std::vector<Keypoint>& keypoints, LoadedDescriptors descriptors,
                   const calib::LensCamera& camera) {
  RayFeatures features;
  features.descriptors = std::move(descriptors);
  const Eigen::Vector2d nowhere =
      Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  for (const Keypoint& keypoint : keypoints) {
    Eigen::Vector2d point = nowhere;
    const Eigen::Vector2d pixel(keypoint.x_px, keypoint.y_px);
    if (pixel.allFinite()) {
      const auto ray = camera.RayFromPixel(pixel);
      if (ray && ray->z() > 0) point = ray->hnormalized();
      if (!(point.norm() < kFarthestSlope)) point = nowhere;
    }
    features.points.push_back(point);
  }
  const double long_side = std::max(camera.width_px, camera.height_px);
  const double short_side = std::min(camera.width_px, camera.height_px);
  features.band = BandOf(long_side) * long_side / camera.params[0];
  features.band_share = 2 * BandOf(long_side) * long_side / short_side;
  features.grid = FeatureGrid(features.points, features.descriptors.all, features.band);
  return features;
}

std::optional<PairGeometry> GeometryOf(const RayFeatures& a, const RayFeatures& b,
                                       const CoarsePair& coarse, bool focal_is_known,
                                       std::uint64_t seed) {
  FeatureMatches largest;
  for (const CoarseMatch& m : coarse.matches) largest.emplace_back(m.a, m.b);
  const PointPairs points = WithRays(a, b, largest).points;
  if (static_cast<int>(points.size()) < kFewestMatches) return std::nullopt;
  const double band = (a.band + b.band) / 2;
  const auto fit =
      focal_is_known ? FitEssential(points, band, seed) : FitFundamental(points, band, seed);
  const double share = std::max(a.band_share, b.band_share);
  const int needed = std::max(kFewestMatches, ChanceInliers(points.size(), share));
  if (!fit || static_cast<int>(fit->inliers.size()) < needed) return std::nullopt;
  std::optional<PairGeometry> pair;
  if (focal_is_known) {
    const auto guided = GuidedOf(a, b, points, fit->pose, band, HashOf(seed, 1));
    if (guided) pair = WithFocal(*guided, band, HashOf(seed, 2));
  } else {
    pair =
        WithoutFocal(WithRays(a, b, GuidedMatches(a.grid, b.grid, fit->m, b.band)), fit->m, band);
  }
  if (!pair) return std::nullopt;
  pair->image_a = coarse.a;
  pair->image_b = coarse.b;
  return pair;
}

}  // namespace dtr::sfm::matching
