#include "dtr/exposure/estimate_gains.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"
#include "dtr/exposure/compare_exposures.h"
#include "dtr/render/colour.h"

namespace dtr {
namespace {

constexpr int kLongSidePx = 320;
constexpr int kDarkest = 4, kBrightest = 250;  ///< 8-bit values that say how bright something was
/// Variance of a pair's logarithm over that of a view's: 1 % and a factor of 1.35.
constexpr double kDamping = 0.001;
constexpr double kMaxGain = 4;
constexpr double kUnnoticed = 0.02;

constexpr int kPairSteps = 20;
constexpr double kSolved = 1e-6;
constexpr double kCauchyMedians = 2, kLeastPairSigma = 0.002;  // scale of Cauchy's loss of pairs

std::vector<ExposurePair> ComparePairs(std::span<const SmallView> views,
                                       std::span<const std::vector<int>> partners) {
  std::vector<std::vector<ExposurePair>> of_view(views.size());
  ParallelFor(0, static_cast<int>(views.size()), [&](int a) {
    for (const int b : partners[static_cast<size_t>(a)]) {
      if (const auto pair = CompareExposures(views, a, b))
        of_view[static_cast<size_t>(a)].push_back(*pair);
    }
  });
  std::vector<ExposurePair> pairs;
  for (const auto& some : of_view) pairs.insert(pairs.end(), some.begin(), some.end());
  return pairs;
}

Eigen::Vector3d MissOf(const ExposurePair& pair, const Eigen::MatrixX3d& logs) {
  return pair.log_exposure - (logs.row(pair.b) - logs.row(pair.a)).transpose();
}

/// Logarithms of what the views are exposed by, a row per view; their mean is 0, as the damping
/// makes it. `shares`: of the pairs' weights.
Eigen::MatrixX3d SolveWeighted(const std::vector<ExposurePair>& pairs,
                               const std::vector<double>& shares, int views) {
  std::vector<Eigen::Triplet<double>> terms;
  Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(views, 3);
  for (int v = 0; v < views; ++v) terms.emplace_back(v, v, kDamping);
  for (size_t i = 0; i < pairs.size(); ++i) {
    const ExposurePair& pair = pairs[i];
    const double weight = shares[i] * pair.weight;
    terms.emplace_back(pair.a, pair.a, weight);
    terms.emplace_back(pair.b, pair.b, weight);
    terms.emplace_back(pair.a, pair.b, -weight);
    terms.emplace_back(pair.b, pair.a, -weight);
    sums.row(pair.b) += weight * pair.log_exposure.transpose();
    sums.row(pair.a) -= weight * pair.log_exposure.transpose();
  }
  Eigen::SparseMatrix<double> normal(views, views);
  normal.setFromTriplets(terms.begin(), terms.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(1e-12);
  solver.compute(normal);
  return solver.solve(sums);
}

/// Under Cauchy's loss: pairs of wrong depth contradict the others, and count little.
Eigen::MatrixX3d SolveExposures(const std::vector<ExposurePair>& pairs, int views) {
  std::vector<double> shares(pairs.size(), 1);
  Eigen::MatrixX3d logs = SolveWeighted(pairs, shares, views);
  for (int step = 0; step < kPairSteps; ++step) {
    std::vector<double> misses;
    for (const ExposurePair& pair : pairs) misses.push_back(MissOf(pair, logs).norm());
    std::vector<double> sorted = misses;
    const double scale = std::max(kCauchyMedians * UpperMedian(sorted), kLeastPairSigma);
    for (size_t i = 0; i < pairs.size(); ++i) {
      shares[i] = 1 / (1 + misses[i] * misses[i] / (scale * scale));
    }
    const Eigen::MatrixX3d next = SolveWeighted(pairs, shares, views);
    const double moved = (next - logs).cwiseAbs().maxCoeff();
    logs = next;
    if (moved < kSolved) break;
  }
  return logs;
}

}  // namespace

SmallView ShrinkForGains(const View& view) {
  const int width = view.image.width(), height = view.image.height();
  const int block = (std::max(width, height) + kLongSidePx - 1) / kLongSidePx;
  const int columns = width / block, rows = height / block;
  const PinholeCamera& k = view.camera;
  SmallView small;
  small.camera = PinholeCamera(columns, rows, k.fx_px() / block, k.fy_px() / block,
                               k.cx_px() / block, k.cy_px() / block);
  small.cam_from_world = view.cam_from_world;
  small.light = Grid<float>(columns, rows, 3);
  small.inverse_depth = Grid<float>(columns, rows);
  const std::array<double, 256>& linear = LinearFromSrgb8();
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      std::array<double, 3> sum{};
      bool usable = true;
      for (int j = y * block; j < (y + 1) * block; ++j) {
        for (int i = x * block; i < (x + 1) * block; ++i) {
          usable = usable && (view.mask.empty() || view.mask(i, j) != 0);
          for (size_t c = 0; c < 3; ++c) {
            const std::uint8_t level = view.image(i, j, static_cast<int>(c));
            usable = usable && level >= kDarkest && level <= kBrightest;
            sum[c] += linear[level];
          }
        }
      }
      const int at_x = (x * block + block / 2) / view.depth_scale;
      const int at_y = (y * block + block / 2) / view.depth_scale;
      if (view.depth.grid().Contains(at_x, at_y)) {
        const float z = view.depth(at_x, at_y);
        small.inverse_depth(x, y) = DepthImage::IsHole(z) ? 0 : 1 / z;
      }
      if (!usable) continue;
      for (size_t c = 0; c < 3; ++c) {
        small.light(x, y, static_cast<int>(c)) = static_cast<float>(sum[c] / (block * block));
      }
    }
  }
  return small;
}

std::vector<Eigen::Vector3d> EstimateGains(std::span<const SmallView> views,
                                           std::span<const std::vector<int>> partners) {
  std::vector<Eigen::Vector3d> gains(views.size(), Eigen::Vector3d::Ones());
  const std::vector<ExposurePair> pairs = ComparePairs(views, partners);
  if (pairs.empty()) return gains;
  const Eigen::MatrixX3d logs = SolveExposures(pairs, static_cast<int>(views.size()));
  if (logs.cwiseAbs().maxCoeff() < kUnnoticed) return gains;
  for (size_t v = 0; v < views.size(); ++v) {
    gains[v] = (-logs.row(static_cast<Eigen::Index>(v)).transpose())
                   .array()
                   .exp()
                   .cwiseMax(1 / kMaxGain)
                   .cwiseMin(kMaxGain);
  }
  return gains;
}

}  // namespace dtr
