#include "pipeline/detail/export/gaussians.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace dtr::pipeline {
namespace {

constexpr int kLevels = 4;  // squares of up to 16 pixels
constexpr float kNoSquare = std::numeric_limits<float>::infinity();
// What costs 1: colours that deviate by so much (root mean square, 8-bit sRGB), surfaces that bend
// by so many pixels of disparity.
constexpr double kColourDeviation = 3, kBendPx = 0.25;
// Variance of a Gaussian in an image, by the square of the distance to its neighbour: less lets
// what lies behind shine through (2 % between four neighbours at this one), more blurs.
constexpr double kVariance = 0.55;
// What renderers add to it, square pixels (Kerbl et al. 2023). The rest is never less than kLeast.
constexpr double kLowPass = 0.3, kLeastVariance = 0.2;
// What a square costs that reaches over the end of its surface.
constexpr double kBesideHole = 10;
// Surfaces are drawn no more oblique to the view than this cosine: its pixels know no better.
constexpr double kLeastCosine = 0.25;
// Thickness along the normal, shares of the distance to its neighbour.
constexpr double kThinnest = 0.05, kThickest = 0.3;
// By the number of views that show a surface there.
constexpr float kOpacities[] = {0.8f, 0.85f, 0.9f};

}  // namespace

SplatTree::SplatTree(const SurfaceView& surface, const std::vector<FusedSample>& samples)
    : camera_(surface.camera),
      rotation_(surface.rotation),
      centre_(surface.centre),
      index_(surface.inverse_depth.width(), surface.inverse_depth.height(), 1, -1) {
  samples_.reserve(samples.size());
  for (const FusedSample& sample : samples) {
    index_(sample.x, sample.y) = static_cast<std::int32_t>(samples_.size());
    samples_.push_back({sample.p_in_world.cast<float>(), sample.normal, sample.sigma, sample.rgb,
                        static_cast<std::uint8_t>(std::min(sample.views, 255))});
  }
  for (int k = 1; k <= kLevels; ++k) {
    const int side = 1 << k;
    Level level{index_.width() / side, index_.height() / side, {}};
    level.cost.assign(static_cast<size_t>(level.columns) * static_cast<size_t>(level.rows),
                      kNoSquare);
    for (int y = 0; y < level.rows; ++y) {
      for (int x = 0; x < level.columns; ++x) {
        float cost = 0;
        for (int child = 0; child < 4 && cost < kNoSquare; ++child) {
          const int cx = 2 * x + child % 2, cy = 2 * y + child / 2;
          if (k == 1) {
            if (index_(cx, cy) < 0) cost = kNoSquare;
          } else {
            const Level& finer = levels_.back();
            cost = std::max(
                cost, finer.cost[static_cast<size_t>(cy) * static_cast<size_t>(finer.columns) +
                                 static_cast<size_t>(cx)]);
          }
        }
        if (cost < kNoSquare) cost = std::max(cost, CostOf(surface, side * x, side * y, side));
        level.cost[static_cast<size_t>(y) * static_cast<size_t>(level.columns) +
                   static_cast<size_t>(x)] = cost;
      }
    }
    levels_.push_back(std::move(level));
  }
}

// Its Gaussian reaches half a side beyond the square, so what lies there must fit too.
float SplatTree::CostOf(const SurfaceView& surface, int x, int y, int side) const {
  double sum[3] = {}, squares[3] = {};
  double w_sum = 0, w_x = 0, w_y = 0, spread = 0;
  int holes = 0;
  const double middle = 0.5 * (side - 1);
  const int x0 = std::max(0, x - side / 2),
            x1 = std::min(surface.colours.width(), x + side + side / 2);
  const int y0 = std::max(0, y - side / 2),
            y1 = std::min(surface.colours.height(), y + side + side / 2);
  for (int v = y0; v < y1; ++v) {
    for (int u = x0; u < x1; ++u) {
      if (!(surface.inverse_depth(u, v) > 0)) {
        ++holes;
        continue;
      }
      for (int c = 0; c < 3; ++c) {
        sum[c] += surface.colours(u, v, c);
        squares[c] += double(surface.colours(u, v, c)) * surface.colours(u, v, c);
      }
    }
  }
  const double around = double(x1 - x0) * (y1 - y0) - holes;
  double deviation = 0;
  for (int c = 0; c < 3; ++c) {
    deviation = std::max(deviation, squares[c] / around - sum[c] * sum[c] / (around * around));
  }
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const double w = surface.inverse_depth(x + i, y + j);
      w_sum += w;
      w_x += w * (i - middle);
      w_y += w * (j - middle);
      spread += (i - middle) * (i - middle);
    }
  }
  double bend = 0;
  for (int v = y0; v < y1; ++v) {
    for (int u = x0; u < x1; ++u) {
      if (!(surface.inverse_depth(u, v) > 0)) continue;
      const double plane = w_sum / (double(side) * side) + w_x / spread * (u - x - middle) +
                           w_y / spread * (v - y - middle);
      bend = std::max(bend, std::abs(surface.inverse_depth(u, v) - plane));
    }
  }
  return static_cast<float>(std::max(
      std::sqrt(std::max(0.0, deviation)) / kColourDeviation + (holes > 0 ? kBesideHole : 0),
      bend / (kBendPx * surface.inverse_depth_per_px)));
}

std::vector<float> SplatTree::MergeCosts() const {
  std::vector<float> costs;
  for (const Level& level : levels_) {
    for (const float cost : level.cost) {
      if (cost < kNoSquare) costs.push_back(cost);
    }
  }
  return costs;
}

bool SplatTree::Merged(size_t level, int x, int y, float bound) const {
  const Level& at = levels_[level];
  return x < at.columns && y < at.rows &&
         at.cost[static_cast<size_t>(y) * static_cast<size_t>(at.columns) +
                 static_cast<size_t>(x)] <= bound;
}

Gaussian SplatTree::GaussianOf(int x, int y, int side) const {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double rgb[3] = {}, sigma = 0;
  int views = 255;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const Sample& sample = At(x + i, y + j);
      p += sample.p.cast<double>();
      normal += sample.normal.cast<double>();
      sigma += sample.sigma;
      views = std::min<int>(views, sample.views);
      for (size_t c = 0; c < 3; ++c) rgb[c] += sample.rgb[c];
    }
  }
  const double count = double(side) * side;
  p /= count;
  sigma /= count;
  const Eigen::Vector3d to_camera = (centre_ - p).normalized();
  normal = normal.norm() > 0 ? Eigen::Vector3d(normal.normalized()) : to_camera;
  if (normal.dot(to_camera) < kLeastCosine) {
    const Eigen::Vector3d across = (normal - normal.dot(to_camera) * to_camera).normalized();
    normal = kLeastCosine * to_camera + std::sqrt(1 - kLeastCosine * kLeastCosine) * across;
  }
  const auto hit = [&](double u, double v) -> Eigen::Vector3d {
    const Eigen::Vector3d ray = rotation_.transpose() * camera_.RayFromPixel({u, v});
    return ray * (normal.dot(p - centre_) / normal.dot(ray));
  };
  // Steps of half a pixel, which no clamped plane turns away from the camera.
  const double u = x + 0.5 * side, v = y + 0.5 * side;
  const Eigen::Vector3d along_u = side * (hit(u + 0.25, v) - hit(u - 0.25, v)) * 2;
  const Eigen::Vector3d along_v = side * (hit(u, v + 0.25) - hit(u, v - 0.25)) * 2;
  const double least = std::min(along_u.norm(), along_v.norm());
  const double thickness = std::clamp(sigma, kThinnest * least, kThickest * least);
  const double variance = std::max(kLeastVariance, kVariance - kLowPass / count);
  const Eigen::Matrix3d covariance =
      variance * (along_u * along_u.transpose() + along_v * along_v.transpose() +
                  thickness * thickness * normal * normal.transpose());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  Gaussian gaussian;
  gaussian.position = p.cast<float>();
  gaussian.deviation = solver.eigenvalues().cwiseMax(1e-30).cwiseSqrt().cast<float>();
  gaussian.world_from_axes = Eigen::Quaterniond(axes).normalized().cast<float>();
  for (size_t c = 0; c < 3; ++c) gaussian.rgb[c] = static_cast<float>(rgb[c] / count / 255);
  gaussian.opacity = kOpacities[std::clamp(views, 1, 3) - 1];
  return gaussian;
}

void SplatTree::AddGaussians(float bound, std::vector<Gaussian>& gaussians) const {
  for (int y = 0; y < index_.height(); ++y) {
    for (int x = 0; x < index_.width(); ++x) {
      if (index_(x, y) < 0) continue;
      int side = 1;
      for (size_t level = 0; level < levels_.size(); ++level) {
        if (!Merged(level, x >> (level + 1), y >> (level + 1), bound)) break;
        side = 2 << level;
      }
      if (x % side == 0 && y % side == 0) gaussians.push_back(GaussianOf(x, y, side));
    }
  }
}

}  // namespace dtr::pipeline
