#include "pipeline/export/detail/gaussians.h"

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
// And one of whose pixels some have no sample, as other views show them better: more than what is
// merged where no number of Gaussians is asked for.
constexpr double kPartial = 1.01;
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
    level.squares.resize(static_cast<size_t>(level.columns) * static_cast<size_t>(level.rows));
    for (int y = 0; y < level.rows; ++y) {
      for (int x = 0; x < level.columns; ++x) {
        const Square square = SquareOf(surface, x, y, side);
        level.squares[static_cast<size_t>(y) * static_cast<size_t>(level.columns) +
                      static_cast<size_t>(x)] = square;
      }
    }
    levels_.push_back(std::move(level));
  }
}

SplatTree::Square SplatTree::SquareOf(const SurfaceView& surface, int x, int y, int side) const {
  Square square{0, -1};
  bool is_full = true;
  for (int child = 0; child < 4; ++child) {
    const int cx = 2 * x + child % 2, cy = 2 * y + child / 2;
    bool is_empty = false;
    if (side == 2) {
      is_empty = index_(cx, cy) < 0;
    } else {
      const Square& finer = levels_.back().At(cx, cy);
      is_empty = !(finer.cost < kNoSquare);
      if (!is_empty) square.cost = std::max(square.cost, finer.cost);
    }
    is_full = is_full && !is_empty;
    square.fewer += is_empty ? 0 : 1;
  }
  if (square.fewer < 0) return {kNoSquare, 0};
  const double partial = is_full ? 0 : kPartial;
  square.cost = std::max(square.cost,
                         static_cast<float>(CostOf(surface, side * x, side * y, side) + partial));
  return square;
}

// Its Gaussian reaches half a side beyond the square, so what lies there must fit too.
double SplatTree::CostOf(const SurfaceView& surface, int x, int y, int side) const {
  double sum[3] = {}, squares[3] = {};
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
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const double w = surface.inverse_depth(x + i, y + j);
      if (!(w > 0)) continue;
      const Eigen::Vector3d at(1, i - middle, j - middle);
      moments += at * at.transpose();
      right += w * at;
    }
  }
  // The plane of 1/z; of pixels in a row the flattest that fits them.
  const Eigen::Vector3d plane_of = moments.completeOrthogonalDecomposition().solve(right);
  double bend = 0;
  for (int v = y0; v < y1; ++v) {
    for (int u = x0; u < x1; ++u) {
      if (!(surface.inverse_depth(u, v) > 0)) continue;
      const double plane = plane_of.dot(Eigen::Vector3d(1, u - x - middle, v - y - middle));
      bend = std::max(bend, std::abs(surface.inverse_depth(u, v) - plane));
    }
  }
  return std::max(
      std::sqrt(std::max(0.0, deviation)) / kColourDeviation + (holes > 0 ? kBesideHole : 0),
      bend / (kBendPx * surface.inverse_depth_per_px));
}

std::vector<SplatTree::Square> SplatTree::Merges() const {
  std::vector<Square> merges;
  for (const Level& level : levels_) {
    for (const Square& square : level.squares) {
      if (square.cost < kNoSquare && square.fewer > 0) merges.push_back(square);
    }
  }
  return merges;
}

bool SplatTree::Merged(size_t level, int x, int y, float bound) const {
  const Level& at = levels_[level];
  return x < at.columns && y < at.rows && at.At(x, y).cost <= bound;
}

Gaussian SplatTree::GaussianOf(int x, int y, int side) const {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double rgb[3] = {}, sigma = 0, count = 0;
  int views = 255;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      if (!Has(x + i, y + j)) continue;
      const Sample& sample = At(x + i, y + j);
      ++count;
      pixel += Eigen::Vector2d(x + i + 0.5, y + j + 0.5);
      p += sample.p.cast<double>();
      normal += sample.normal.cast<double>();
      sigma += sample.sigma;
      views = std::min<int>(views, sample.views);
      for (size_t c = 0; c < 3; ++c) rgb[c] += sample.rgb[c];
    }
  }
  p /= count;
  pixel /= count;
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
  const double u = pixel.x(), v = pixel.y(), width = std::sqrt(count);
  const Eigen::Vector3d along_u = width * (hit(u + 0.25, v) - hit(u - 0.25, v)) * 2;
  const Eigen::Vector3d along_v = width * (hit(u, v + 0.25) - hit(u, v - 0.25)) * 2;
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
      const int left = x - x % side, top = y - y % side;
      if (IsFirst(x, y, left, top, side)) gaussians.push_back(GaussianOf(left, top, side));
    }
  }
}

// Of the samples of a square, row by row.
bool SplatTree::IsFirst(int x, int y, int left, int top, int side) const {
  for (int v = top; v <= y; ++v) {
    for (int u = left; u < left + side; ++u) {
      if (Has(u, v)) return u == x && v == y;
    }
  }
  return false;
}

}  // namespace dtr::pipeline
