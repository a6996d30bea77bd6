#include "calib/sfm/matching/lens_pair.h"

#include <cmath>
#include <optional>

#include "calib/sfm/matching/planar_poses.h"
#include "calib/sfm/matching/robust_fit.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr int kFocals = 17;
constexpr double kLowestFocal = 0.4, kHighestFocal = 4;
// Of a fisheye: 180 degrees on the long side are 0.32.
constexpr double kLowestFisheye = 0.15, kHighestFisheye = 1.5;

double FocalOf(const LensPair& lenses) { return std::sqrt(lenses.a.focal * lenses.b.focal); }

// The homography between the photos that many of the matches agree with, offsets in long sides.
struct Plane {
  Eigen::Matrix3d h = Eigen::Matrix3d::Zero();
  PointPairs points;
};
std::optional<Plane> PlaneOf(const VotePair& pair) {
  constexpr double kBand = 3 * kGridScale, kLeastShare = 0.4;
  const auto fit = FitHomography(pair.points, kBand, HashOf(0, pair.photo_a, pair.photo_b));
  const auto count = static_cast<double>(pair.points.size());
  if (!fit || static_cast<double>(fit->inliers.size()) < kLeastShare * count) return std::nullopt;
  Plane plane{fit->m, {}};
  for (const int i : fit->inliers) {
    plane.points.Add(pair.points.a[static_cast<size_t>(i)], pair.points.b[static_cast<size_t>(i)]);
  }
  return plane;
}

// The two poses that a plane leaves. A pair's fundamental matrix, fitted to what lies off the plane
// and to wrong matches, may lead to the wrong one, which explains the plane as well.
void AddPosesOfPlane(const Plane& plane, const LensPair& lenses, std::vector<RelativePose>& poses) {
  const double fa = lenses.a.focal, fb = lenses.b.focal;
  PointPairs points;
  for (size_t i = 0; i < plane.points.size(); ++i) {
    points.Add(plane.points.a[i] / fa, plane.points.b[i] / fb);
  }
  const Eigen::Vector3d of_a(fa, fa, 1), of_b(1 / fb, 1 / fb, 1);
  const auto both = PosesOfPlane(of_b.asDiagonal() * plane.h * of_a.asDiagonal(), points);
  if (both) poses.insert(poses.end(), both->begin(), both->end());
}

Posed BestOf(const std::vector<RelativePose>& starts, const Unbending& matches, double scale,
             int iterations) {
  Posed best;
  for (const RelativePose& start : starts) {
    Posed posed = Refined(matches, start, scale, iterations);
    if (posed.cost < best.cost) best = posed;
  }
  return best;
}

}  // namespace

Unbending Unbend(const LensPair& lenses, const PointPairs& from, double scale) {
  Unbending to;
  for (size_t i = 0; i < from.size(); ++i) {
    double ma = 1, mb = 1;
    const auto a = Unbent(lenses.a, from.a[i], &ma), b = Unbent(lenses.b, from.b[i], &mb);
    if (!a || !b) {
      ++to.beyond;
      continue;
    }
    to.points.Add(*a, *b);
    to.scale.push_back(scale * std::sqrt(ma * mb));
  }
  return to;
}

double CostOf(const Unbending& matches, const RelativePose& pose) {
  const Eigen::Matrix3d e = pose.Essential();
  double cost = matches.beyond;
  for (size_t i = 0; i < matches.points.size(); ++i) {
    const double s = SampsonSquared(e, matches.points.a[i], matches.points.b[i]);
    const double u = s / (matches.scale[i] * matches.scale[i]);
    cost += std::isfinite(u) ? RobustCost(u) : 1;
  }
  return cost;
}

Posed Refined(const Unbending& matches, const RelativePose& start, double scale, int iterations) {
  Posed posed;
  posed.pose = RefinePose(start, matches.points, scale, iterations);
  posed.cost = CostOf(matches, posed.pose);
  return posed;
}

RelativePose FromFundamental(const VotePair& pair, const LensPair& lenses,
                             const Unbending& matches) {
  if (lenses.a.fisheye) return PoseFromEssential(pair.fundamental, matches.points, {});
  const Eigen::Vector3d a(lenses.a.focal, lenses.a.focal, 1), b(lenses.b.focal, lenses.b.focal, 1);
  return PoseFromEssential(b.asDiagonal() * pair.fundamental * a.asDiagonal(), matches.points, {});
}

std::vector<Posed> OverLenses(const VotePair& pair, const std::vector<LensPair>& lenses) {
  std::vector<Posed> all;
  const auto plane = lenses.front().a.fisheye ? std::nullopt : PlaneOf(pair);
  for (const LensPair& at : lenses) {
    const Unbending matches = Unbend(at, pair.points, kGridScale);
    std::vector<RelativePose> starts{FromFundamental(pair, at, matches)};
    if (!all.empty()) starts.push_back(all.back().pose);
    if (plane) AddPosesOfPlane(*plane, at, starts);
    all.push_back(BestOf(starts, matches, kGridScale / FocalOf(at), 4));
  }
  return all;
}

Posed Reposed(const VotePair& pair, const LensPair& lenses) {
  constexpr double kBandScales = 3;
  const double scale = kScale / FocalOf(lenses);
  const Unbending matches = Unbend(lenses, pair.points, kScale);
  std::vector<RelativePose> starts;
  const auto fit =
      FitEssential(matches.points, kBandScales * scale, HashOf(1, pair.photo_a, pair.photo_b));
  if (fit) starts.push_back(fit->pose);
  const auto plane = lenses.a.fisheye ? std::nullopt : PlaneOf(pair);
  if (plane) AddPosesOfPlane(*plane, lenses, starts);
  return BestOf(starts, matches, scale, 10);
}

VoteLens Stepped(const VoteLens& lens, double log_focal, double k1) {
  return {lens.focal * std::exp(log_focal), lens.k1 + k1, lens.fisheye, lens.centre};
}

std::vector<double> FocalGrid(bool fisheye) {
  const double lowest = fisheye ? kLowestFisheye : kLowestFocal;
  const double step =
      std::log((fisheye ? kHighestFisheye : kHighestFocal) / lowest) / (kFocals - 1);
  std::vector<double> focals;
  for (int i = 0; i < kFocals; ++i) focals.push_back(lowest * std::exp(step * i));
  return focals;
}

}  // namespace dtr::sfm::matching
