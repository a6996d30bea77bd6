#include "calib/sfm/matching/match_photos.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "calib/sfm/matching/guided.h"
#include "calib/sfm/matching/pair_choice.h"
#include "calib/sfm/matching/pair_kind.h"
#include "calib/sfm/matching/robust_fit.h"
#include "calib/sfm/matching/vote_cameras.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm {
namespace {

using namespace matching;

constexpr size_t kLargest = 3000;      // features of a photo for the search anywhere
constexpr int kFewestMatches = 15;     // COLMAP's min_num_inliers
constexpr double kFarthestSlope = 11;  // tangent of 85 degrees

void Check(std::span<const MatchPhoto> photos, std::span<const calib::LensCamera> cameras,
           const std::vector<bool>& focal_is_known) {
  if (focal_is_known.size() != cameras.size()) {
    throw std::invalid_argument("MatchPhotos: focal_is_known is not of the cameras");
  }
  for (const calib::LensCamera& camera : cameras) camera.Check();
  for (const MatchPhoto& photo : photos) {
    if (photo.camera < 0 || static_cast<size_t>(photo.camera) >= cameras.size()) {
      throw std::invalid_argument("MatchPhotos: a photo's camera is not among the cameras");
    }
    if (photo.features.keypoints.size() != photo.features.descriptors.size()) {
      throw std::invalid_argument("MatchPhotos: keypoints and descriptors differ in number");
    }
  }
}

// A photo as the second stage sees it. The grid borrows the points: it moves, but is not copied.
struct Seen {
  Seen() = default;
  Seen(Seen&&) = default;
  Seen& operator=(Seen&&) = default;

  std::vector<Eigen::Vector2d> points;  // on z = 1; NaN: no ray
  FeatureGrid grid;
  double band = 0;        // BandOf at the centre, on z = 1
  double band_share = 0;  // share of the photo within a band of a line
};

Seen See(const MatchPhoto& photo, const calib::LensCamera& camera) {
  Seen seen;
  const Eigen::Vector2d nowhere =
      Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  for (const Keypoint& keypoint : photo.features.keypoints) {
    Eigen::Vector2d point = nowhere;
    const Eigen::Vector2d pixel(keypoint.x_px, keypoint.y_px);
    if (pixel.allFinite()) {
      const auto ray = camera.RayFromPixel(pixel);
      if (ray && ray->z() > 0) point = ray->hnormalized();
      if (!(point.norm() < kFarthestSlope)) point = nowhere;
    }
    seen.points.push_back(point);
  }
  const double long_side = std::max(camera.width_px, camera.height_px);
  const double short_side = std::min(camera.width_px, camera.height_px);
  seen.band = BandOf(long_side) * long_side / camera.params[0];
  seen.band_share = 2 * BandOf(long_side) * long_side / short_side;
  seen.grid = FeatureGrid(seen.points, photo.features.descriptors, seen.band);
  return seen;
}

struct RayMatches {
  PointPairs points;
  FeatureMatches matches;
};

// The matches both of whose features have a ray.
RayMatches WithRays(const Seen& a, const Seen& b, const FeatureMatches& matches) {
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

Guided Along(const Seen& a, const Seen& b, const RelativePose& pose, double band) {
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
std::optional<Guided> GuidedOf(const Seen& a, const Seen& b, const PointPairs& coarse,
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

std::optional<PairGeometry> GeometryOf(const Seen& a, const Seen& b, const CoarsePair& coarse,
                                       bool focal_is_known, std::uint64_t seed) {
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

std::vector<CoarsePair> CoarseSearch(std::span<const MatchPhoto> photos,
                                     const std::vector<std::pair<int, int>>& pairs,
                                     const MatchOptions& options, Progress& progress) {
  std::vector<CoarsePair> coarse(pairs.size());
  progress.Stage("comparing features", static_cast<int>(pairs.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(pairs.size()), options.threads, [&](int k) {
    progress.ThrowIfInterrupted();
    const auto [a, b] = pairs[static_cast<size_t>(k)];
    coarse[static_cast<size_t>(k)] = {
        a, b,
        CoarseMatches(photos[static_cast<size_t>(a)].features,
                      photos[static_cast<size_t>(b)].features, kLargest)};
    progress.Update(++done);
  });
  return coarse;
}

// Pairs along epipolar lines, in order; those without a geometry are left out.
std::vector<PairGeometry> Geometries(std::span<const MatchPhoto> photos,
                                     const std::vector<CoarsePair>& coarse, const ViewGraph& graph,
                                     const MatchOptions& options, Progress& progress) {
  std::vector<Seen> seen(photos.size());
  ParallelFor(0, static_cast<int>(photos.size()), options.threads, [&](int i) {
    const MatchPhoto& photo = photos[static_cast<size_t>(i)];
    seen[static_cast<size_t>(i)] = See(photo, graph.cameras[static_cast<size_t>(photo.camera)]);
  });
  std::vector<std::optional<PairGeometry>> found(coarse.size());
  progress.Stage("matching", static_cast<int>(coarse.size()));
  std::atomic<int> done = 0;
  ParallelFor(0, static_cast<int>(coarse.size()), options.threads, [&](int k) {
    progress.ThrowIfInterrupted();
    const CoarsePair& pair = coarse[static_cast<size_t>(k)];
    const auto a = static_cast<size_t>(pair.a), b = static_cast<size_t>(pair.b);
    const bool known = graph.focal_is_known[static_cast<size_t>(photos[a].camera)] &&
                       graph.focal_is_known[static_cast<size_t>(photos[b].camera)];
    found[static_cast<size_t>(k)] =
        GeometryOf(seen[a], seen[b], pair, known, HashOf(options.seed, 2, pair.a, pair.b));
    progress.Update(++done);
  });
  std::vector<PairGeometry> pairs;
  for (auto& pair : found) {
    if (pair) pairs.push_back(std::move(*pair));
  }
  return pairs;
}

}  // namespace

MatchResult MatchPhotos(std::span<const MatchPhoto> photos,
                        std::span<const calib::LensCamera> cameras,
                        const std::vector<bool>& focal_is_known, const MatchOptions& options) {
  Check(photos, cameras, focal_is_known);
  SilentProgress silent;
  Progress& progress = options.progress != nullptr ? *options.progress : silent;
  MatchResult result;
  ViewGraph& graph = result.graph;
  graph.cameras.assign(cameras.begin(), cameras.end());
  graph.focal_is_known = focal_is_known;
  for (const MatchPhoto& photo : photos) {
    GraphImage image{photo.name, photo.camera, {}};
    for (const Keypoint& k : photo.features.keypoints) image.pixels.emplace_back(k.x_px, k.y_px);
    graph.images.push_back(std::move(image));
  }
  const auto pairs = ChoosePairs(photos, options, progress);
  const auto coarse = CoarseSearch(photos, pairs, options, progress);
  for (size_t c = 0; c < options.lens_is_known.size(); ++c) {
    if (options.lens_is_known[c]) graph.focal_is_known[c] = true;
  }
  VoteOnCameras(photos, coarse, options, graph, result.notes);
  graph.pairs = Geometries(photos, coarse, graph, options, progress);
  return result;
}

}  // namespace dtr::sfm
