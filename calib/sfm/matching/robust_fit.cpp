#include "calib/sfm/matching/robust_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr int kLeastIterations = 30, kMostIterations = 1000;
// Only homographies that explain four fifths of the points are of interest: 13 samples find them.
constexpr int kHomographyIterations = 60;
constexpr double kMissed = 1e-3;    // probability of never drawing a sample without outliers
constexpr double kGrowthEnd = 300;  // iterations after which samples come from all points

// Distinct indices below `pool`.
template <size_t kCount>
std::array<int, kCount> Draw(int pool, Random& random) {
  std::array<int, kCount> sample{};
  for (size_t i = 0; i < kCount; ++i) {
    do {
      sample[i] = random.Index(pool);
    } while (std::find(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(i),
                       sample[i]) != sample.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return sample;
}

// `solve`: matrices of a sample; `squared`: squared distance of match i to a matrix; `improve`:
// a matrix refined on the points it explains, or empty.
template <size_t kCount, typename Solve, typename Squared, typename Improve>
std::optional<Eigen::Matrix3d> Ransac(size_t count, double threshold, std::uint64_t seed, int most,
                                      const Solve& solve, const Squared& squared,
                                      const Improve& improve) {
  if (count < kCount) return std::nullopt;
  Random random(seed);
  const double limit = threshold * threshold;
  const auto cost_of = [&](const Eigen::Matrix3d& m, double stop, int& inliers) {
    double cost = 0;
    inliers = 0;
    for (size_t i = 0; i < count && cost < stop; ++i) {
      const double s = squared(m, i);
      if (s < limit) ++inliers;
      cost += s < limit ? s : limit;
    }
    return cost;
  };
  std::optional<Eigen::Matrix3d> best;
  double best_cost = std::numeric_limits<double>::infinity(), needed = most;
  for (int k = 0; k < most && (k < kLeastIterations || k < needed); ++k) {
    const double grown = kCount + 5 + static_cast<double>(count) * k / kGrowthEnd;
    const int pool = static_cast<int>(std::min(grown, static_cast<double>(count)));
    const auto sample = Draw<kCount>(pool, random);
    bool better = false;
    int inliers = 0;
    const auto take = [&](const Eigen::Matrix3d& m) {
      int some = 0;
      const double cost = cost_of(m, best_cost, some);
      if (cost >= best_cost) return;
      best_cost = cost;
      best = m;
      inliers = some;
      better = true;
    };
    for (const Eigen::Matrix3d& m : solve(sample)) take(m);
    if (!better) continue;
    if (const auto improved = improve(*best)) take(*improved);
    const double share = static_cast<double>(inliers) / static_cast<double>(count);
    const double good = std::pow(share, static_cast<double>(kCount));
    needed = good >= 1 ? 0 : std::log(kMissed) / std::log1p(-std::max(good, 1e-12));
  }
  return best;
}

PointPairs Chosen(const PointPairs& points, const std::vector<int>& indices) {
  PointPairs chosen;
  for (const int i : indices) {
    chosen.Add(points.a[static_cast<size_t>(i)], points.b[static_cast<size_t>(i)]);
  }
  return chosen;
}

Eigen::Matrix3d Similar(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  double spread = 0;
  for (const auto& p : points) spread += (p - mean).norm() / static_cast<double>(points.size());
  const double scale = spread > 0 ? 1 / spread : 1;
  Eigen::Matrix3d m;
  m << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return m;
}

std::optional<Eigen::Matrix3d> HomographyFromMany(const PointPairs& points) {
  if (points.size() < 4) return std::nullopt;
  const Eigen::Matrix3d na = Similar(points.a), nb = Similar(points.b);
  Eigen::Matrix<double, 9, 9> sum = Eigen::Matrix<double, 9, 9>::Zero();
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = na * points.a[i].homogeneous(), q = nb * points.b[i].homogeneous();
    Eigen::Matrix<double, 2, 9> rows;
    rows << p.transpose(), Eigen::RowVector3d::Zero(), -q.x() * p.transpose(),
        Eigen::RowVector3d::Zero(), p.transpose(), -q.y() * p.transpose();
    sum.noalias() += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(sum);
  const Eigen::Matrix<double, 9, 1> v = solver.eigenvectors().col(0);
  Eigen::Matrix3d h;
  h << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
  h = nb.inverse() * h * na;
  const double norm = h.norm();
  if (!(norm > 0) || !std::isfinite(norm)) return std::nullopt;
  return h / norm;
}

double TransferSquared(const Eigen::Matrix3d& h, const Eigen::Vector2d& a,
                       const Eigen::Vector2d& b) {
  const Eigen::Vector3d p = h * a.homogeneous();
  if (!(std::abs(p.z()) > 1e-12)) return std::numeric_limits<double>::infinity();
  return (p.hnormalized() - b).squaredNorm();
}

std::vector<double> InlierWeights(const Eigen::Matrix3d& m, const PointPairs& points,
                                  double threshold) {
  std::vector<double> weights(points.size(), 0);
  for (const int i : EpipolarInliers(m, points, threshold)) weights[static_cast<size_t>(i)] = 1;
  return weights;
}

}  // namespace

std::vector<int> EpipolarInliers(const Eigen::Matrix3d& m, const PointPairs& points,
                                 double threshold) {
  std::vector<int> inliers;
  for (size_t i = 0; i < points.size(); ++i) {
    if (SampsonSquared(m, points.a[i], points.b[i]) < threshold * threshold) {
      inliers.push_back(static_cast<int>(i));
    }
  }
  return inliers;
}

std::optional<RobustFit> FitEssential(const PointPairs& points, double threshold,
                                      std::uint64_t seed) {
  const auto pose_of = [&](const Eigen::Matrix3d& m) {
    return PoseFromEssential(m, points, InlierWeights(m, points, threshold));
  };
  const auto m = Ransac<5>(
      points.size(), threshold, seed, kMostIterations,
      [&](const auto& sample) { return EssentialFromFive(points, sample); },
      [&](const Eigen::Matrix3d& e, size_t i) {
        return SampsonSquared(e, points.a[i], points.b[i]);
      },
      [&](const Eigen::Matrix3d& e) -> std::optional<Eigen::Matrix3d> {
        if (EpipolarInliers(e, points, threshold).size() < 8) return std::nullopt;
        return RefinePose(pose_of(e), points, threshold, 4).Essential();
      });
  if (!m) return std::nullopt;
  RobustFit fit;
  fit.pose = RefinePose(pose_of(*m), points, threshold / 2, 10);
  fit.m = fit.pose.Essential();
  fit.inliers = EpipolarInliers(fit.m, points, threshold);
  return fit;
}

std::optional<RobustFit> FitFundamental(const PointPairs& points, double threshold,
                                        std::uint64_t seed) {
  const auto improve = [&](const Eigen::Matrix3d& f) {
    return FundamentalFromMany(points, InlierWeights(f, points, threshold));
  };
  const auto m = Ransac<7>(
      points.size(), threshold, seed, kMostIterations,
      [&](const auto& sample) { return FundamentalFromSeven(points, sample); },
      [&](const Eigen::Matrix3d& f, size_t i) {
        return SampsonSquared(f, points.a[i], points.b[i]);
      },
      improve);
  if (!m) return std::nullopt;
  RobustFit fit;
  fit.m = *m;
  fit.inliers = EpipolarInliers(fit.m, points, threshold);
  return fit;
}

std::optional<RobustFit> FitHomography(const PointPairs& points, double threshold,
                                       std::uint64_t seed) {
  const auto inliers_of = [&](const Eigen::Matrix3d& h) {
    std::vector<int> inliers;
    for (size_t i = 0; i < points.size(); ++i) {
      if (TransferSquared(h, points.a[i], points.b[i]) < threshold * threshold) {
        inliers.push_back(static_cast<int>(i));
      }
    }
    return inliers;
  };
  const auto m = Ransac<4>(
      points.size(), threshold, seed, kHomographyIterations,
      [&](const auto& sample) {
        std::vector<Eigen::Matrix3d> found;
        const auto h = HomographyFromMany(Chosen(points, {sample.begin(), sample.end()}));
        if (h) found.push_back(*h);
        return found;
      },
      [&](const Eigen::Matrix3d& h, size_t i) {
        return TransferSquared(h, points.a[i], points.b[i]);
      },
      [&](const Eigen::Matrix3d& h) { return HomographyFromMany(Chosen(points, inliers_of(h))); });
  if (!m) return std::nullopt;
  RobustFit fit;
  fit.m = *m;
  fit.inliers = inliers_of(*m);
  return fit;
}

double MedianHomographyDistance(const PointPairs& points) {
  const auto h = HomographyFromMany(points);
  if (!h) return 0;
  std::vector<double> squared;
  for (size_t i = 0; i < points.size(); ++i) {
    squared.push_back(TransferSquared(*h, points.a[i], points.b[i]));
  }
  const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return std::sqrt(*middle);
}

int ChanceInliers(size_t count, double band_share) {
  // Five matches fit exactly, and RANSAC picks the luckiest of a thousand draws of the rest: 4
  // standard deviations above the mean of a binomial distribution.
  const double mean = static_cast<double>(count) * band_share;
  return 7 + static_cast<int>(std::ceil(mean + 4 * std::sqrt(mean)));
}

}  // namespace dtr::sfm::matching
