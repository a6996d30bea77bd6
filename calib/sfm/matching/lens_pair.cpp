#include "calib/sfm/matching/lens_pair.h"

#include <cmath>

namespace dtr::sfm::matching {
namespace {

constexpr int kFocals = 17;
constexpr double kLowestFocal = 0.4, kHighestFocal = 4;
// Of a fisheye: 180 degrees on the long side are 0.32.
constexpr double kLowestFisheye = 0.15, kHighestFisheye = 1.5;

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
  for (const LensPair& at : lenses) {
    const Unbending matches = Unbend(at, pair.points, kGridScale);
    RelativePose start = FromFundamental(pair, at, matches);
    if (!all.empty() && CostOf(matches, all.back().pose) < CostOf(matches, start)) {
      start = all.back().pose;
    }
    all.push_back(Refined(matches, start, kGridScale / std::sqrt(at.a.focal * at.b.focal), 4));
  }
  return all;
}

VoteLens Stepped(const VoteLens& lens, double log_focal, double k1) {
  return {lens.focal * std::exp(log_focal), lens.k1 + k1, lens.fisheye};
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
