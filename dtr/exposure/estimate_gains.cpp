#include "dtr/exposure/estimate_gains.h"

#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"

namespace dtr {
namespace {

constexpr int kLongSidePx = 320;
constexpr int kDarkest = 4, kBrightest = 250;  ///< 8-bit values that say how bright something was
constexpr float kSameSurfacePx = 1;            ///< of disparity, in little
constexpr size_t kMinPixels = 50;              ///< in common, for two views to be compared
constexpr double kFullPixels = 500;            ///< from which on more of them count no more
/// Variance of a pair's logarithm over that of a view's: 3 % and a factor of 1.35.
constexpr double kDamping = 0.01;
constexpr double kMaxGain = 4;
constexpr double kUnnoticed = 0.02;

struct Pair {
  int a, b;
  double weight;
  Eigen::Vector3d log_exposure;  ///< from what a shows to what b shows
};

std::optional<Pair> Compare(std::span<const SmallView> views, int a, int b) {
  const SmallView &from = views[static_cast<size_t>(a)], &to = views[static_cast<size_t>(b)];
  const Pose to_from_from = to.cam_from_world * from.cam_from_world.Inverse();
  const auto px_per_inverse_depth =
      static_cast<float>(to.camera.fx_px() * to_from_from.translation.norm());
  std::array<std::vector<double>, 3> log_exposures;
  for (int y = 0; y < from.light.height(); ++y) {
    for (int x = 0; x < from.light.width(); ++x) {
      const float w = from.inverse_depth(x, y);
      if (!(w > 0) || !(from.light(x, y, 0) > 0)) continue;
      const Eigen::Vector3d point =
          to_from_from * (from.camera.RayFromPixel({x + 0.5, y + 0.5}) / static_cast<double>(w));
      const auto pixel = to.camera.PixelFromCam(point);
      if (!pixel || !to.camera.Contains(*pixel)) continue;
      const int u = static_cast<int>(pixel->x()), v = static_cast<int>(pixel->y());
      const float seen = to.inverse_depth(u, v);
      if (!(seen > 0) || !(to.light(u, v, 0) > 0)) continue;
      const float off = (seen - static_cast<float>(1 / point.z())) * px_per_inverse_depth;
      if (std::abs(off) > kSameSurfacePx) continue;
      for (int c = 0; c < 3; ++c) {
        log_exposures[static_cast<size_t>(c)].push_back(std::log(ExposureBetween(
            static_cast<double>(from.light(x, y, c)), static_cast<double>(to.light(u, v, c)))));
      }
    }
  }
  if (log_exposures[0].size() < kMinPixels) return std::nullopt;
  Pair pair{a, b, std::min(1.0, static_cast<double>(log_exposures[0].size()) / kFullPixels), {}};
  for (int c = 0; c < 3; ++c)
    pair.log_exposure[c] = UpperMedian(log_exposures[static_cast<size_t>(c)]);
  return pair;
}

std::vector<Pair> ComparePairs(std::span<const SmallView> views,
                               std::span<const std::vector<int>> partners, int threads) {
  std::vector<std::vector<Pair>> of_view(views.size());
  ParallelFor(0, static_cast<int>(views.size()), threads, [&](int a) {
    for (const int b : partners[static_cast<size_t>(a)]) {
      if (const auto pair = Compare(views, a, b)) of_view[static_cast<size_t>(a)].push_back(*pair);
    }
  });
  std::vector<Pair> pairs;
  for (const auto& some : of_view) pairs.insert(pairs.end(), some.begin(), some.end());
  return pairs;
}

/// Logarithms of what the views are exposed by, a row per view; their mean is 0, as the damping
/// makes it.
Eigen::MatrixX3d SolveExposures(const std::vector<Pair>& pairs, int views) {
  std::vector<Eigen::Triplet<double>> terms;
  Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(views, 3);
  for (int v = 0; v < views; ++v) terms.emplace_back(v, v, kDamping);
  for (const Pair& pair : pairs) {
    terms.emplace_back(pair.a, pair.a, pair.weight);
    terms.emplace_back(pair.b, pair.b, pair.weight);
    terms.emplace_back(pair.a, pair.b, -pair.weight);
    terms.emplace_back(pair.b, pair.a, -pair.weight);
    sums.row(pair.b) += pair.weight * pair.log_exposure.transpose();
    sums.row(pair.a) -= pair.weight * pair.log_exposure.transpose();
  }
  Eigen::SparseMatrix<double> normal(views, views);
  normal.setFromTriplets(terms.begin(), terms.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(1e-12);
  solver.compute(normal);
  return solver.solve(sums);
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
                                           std::span<const std::vector<int>> partners,
                                           int threads) {
  std::vector<Eigen::Vector3d> gains(views.size(), Eigen::Vector3d::Ones());
  const std::vector<Pair> pairs = ComparePairs(views, partners, threads);
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
