#include "stereo/depth_prior.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dtr/base/order_statistics.h"

namespace dtr::stereo {
namespace {

constexpr int kFitRadius = 2;
/// Fewer pixels of one surface than this determine no slopes.
constexpr int kMinFitPixels = 6;
/// Differences of neighbours that noise explains, in standard deviations of one pixel; never less
/// than what slanted surfaces have, never so much that everything is one surface.
constexpr double kEdgeSigmas = 5, kMinEdgeRatio = 0.03, kMaxEdgeRatio = 0.3;
/// Standard deviation of a normal distribution over the median of its magnitude.
constexpr double kSigmaPerMedian = 1.4826;

Grid<float> Inverse(const DepthImage& depth) {
  Grid<float> inverse(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (!DepthImage::IsHole(depth(x, y))) inverse(x, y) = 1.0f / depth(x, y);
    }
  }
  return inverse;
}

/// Of one pixel, relative to its inverse depth. Second differences cancel slopes; they have six
/// times a pixel's variance.
double NoiseOf(const Grid<float>& inverse) {
  // Some rows are enough, and bound the memory.
  constexpr int kRows = 200;
  std::vector<double> differences;
  for (int y = 0; y < inverse.height(); y += 1 + inverse.height() / kRows) {
    for (int x = 1; x + 1 < inverse.width(); ++x) {
      const double a = inverse(x - 1, y), b = inverse(x, y), c = inverse(x + 1, y);
      if (!(a > 0) || !(b > 0) || !(c > 0)) continue;
      differences.push_back(std::abs(a - 2 * b + c) / b);
    }
  }
  if (differences.empty()) return 0;
  return kSigmaPerMedian * UpperMedian(differences) / std::sqrt(6.0);
}

}  // namespace

double RelativeNoise::At(double distance) const {
  const auto above = std::upper_bound(z.begin(), z.end(), distance);
  if (above == z.begin()) return sigma.front();
  if (above == z.end()) return sigma.back();
  const auto i = static_cast<size_t>(above - z.begin());
  const double t = (distance - z[i - 1]) / (z[i] - z[i - 1]);
  return (1 - t) * sigma[i - 1] + t * sigma[i];
}

PriorPlanes::PriorPlanes(const DepthImage& depth)
    : inverse_depth_(depth.width(), depth.height()),
      slope_x_(depth.width(), depth.height()),
      slope_y_(depth.width(), depth.height()),
      at_edge_(depth.width(), depth.height()) {
  if (depth.kind() != DepthKind::kPlaneZ) {
    throw std::invalid_argument("PriorPlanes: expected plane z, whose inverse is linear on planes");
  }
  const Grid<float> inverse = Inverse(depth);
  edge_ratio_ = std::clamp(kEdgeSigmas * NoiseOf(inverse), kMinEdgeRatio, kMaxEdgeRatio);
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (inverse(x, y) > 0) Fit(inverse, x, y);
    }
  }
}

namespace {

/// Change of the inverse depth to the next pixel along an axis: the mean of both sides where they
/// continue each other, which a slanted surface does, else the smaller one.
double SlopeAt(const Grid<float>& inverse, int x, int y, int step_x, int step_y, double tolerance) {
  const double own = inverse(x, y);
  const auto difference = [&](int sign) -> std::optional<double> {
    const int u = x + sign * step_x, v = y + sign * step_y;
    if (!inverse.Contains(u, v) || !(inverse(u, v) > 0)) return std::nullopt;
    return sign * (inverse(u, v) - own);
  };
  const auto before = difference(-1), after = difference(1);
  if (before && after && std::abs(*after - *before) <= tolerance) return (*before + *after) / 2;
  const double smaller =
      std::min(std::abs(before.value_or(tolerance)), std::abs(after.value_or(tolerance)));
  if (smaller >= tolerance) return 0;
  return before && std::abs(*before) == smaller ? *before : *after;
}

}  // namespace

void PriorPlanes::Fit(const Grid<float>& inverse, int x, int y) {
  const double own = inverse(x, y), tolerance = edge_ratio_ * own;
  const double slope_x = SlopeAt(inverse, x, y, 1, 0, tolerance);
  const double slope_y = SlopeAt(inverse, x, y, 0, 1, tolerance);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int count = 0;
  bool edge = false;
  for (int dy = -kFitRadius; dy <= kFitRadius; ++dy) {
    for (int dx = -kFitRadius; dx <= kFitRadius; ++dx) {
      if (!inverse.Contains(x + dx, y + dy)) continue;
      const double other = inverse(x + dx, y + dy);
      const int steps = std::max(1, std::max(std::abs(dx), std::abs(dy)));
      const double expected = own + slope_x * dx + slope_y * dy;
      if (!(other > 0) || std::abs(other - expected) > steps * tolerance) {
        edge = edge || steps == 1;
        continue;
      }
      const Eigen::Vector3d row(1, dx, dy);
      normal += row * row.transpose();
      right += row * other;
      ++count;
    }
  }
  Eigen::Vector3d plane(own, 0, 0);
  if (count >= kMinFitPixels) {
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    // All on one line determine no plane.
    if (solver.vectorD().minCoeff() > 1e-6) plane = solver.solve(right);
    if (!(plane.x() > 0)) plane = {own, 0, 0};
  }
  inverse_depth_(x, y) = static_cast<float>(plane.x());
  slope_x_(x, y) = static_cast<float>(plane.y());
  slope_y_(x, y) = static_cast<float>(plane.z());
  at_edge_(x, y) = edge ? 1 : 0;
}

std::optional<PriorPlanes::Plane> PriorPlanes::At(const Eigen::Vector2d& share) const {
  const int width = inverse_depth_.width(), height = inverse_depth_.height();
  const double u = share.x() * width, v = share.y() * height;
  if (!(u >= 0) || !(v >= 0) || !(u < width) || !(v < height)) return std::nullopt;
  const int nx = static_cast<int>(u), ny = static_cast<int>(v);
  if (IsHole(nx, ny)) return std::nullopt;
  const auto value = [&](int x, int y) {
    return inverse_depth_(x, y) + slope_x_(x, y) * (u - (x + 0.5)) +
           slope_y_(x, y) * (v - (y + 0.5));
  };
  const double nearest = value(nx, ny);
  // Between the four pixels around, as far as they are one surface with the nearest.
  const int x0 = static_cast<int>(std::floor(u - 0.5)), y0 = static_cast<int>(std::floor(v - 0.5));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (int y = y0; y <= y0 + 1; ++y) {
    for (int x = x0; x <= x0 + 1; ++x) {
      if (!inverse_depth_.Contains(x, y) || IsHole(x, y)) continue;
      const double w = value(x, y);
      if (std::abs(w - nearest) > edge_ratio_ * nearest) continue;
      const double k = (1 - std::abs(u - 0.5 - x)) * (1 - std::abs(v - 0.5 - y));
      sum += k * Eigen::Vector3d(w, slope_x_(x, y), slope_y_(x, y));
      weights += k;
    }
  }
  if (!(weights > 0) || !(sum.x() > 0)) return std::nullopt;
  sum /= weights;
  return Plane{sum.x(), sum.y() * width, sum.z() * height, at_edge_(nx, ny) != 0};
}

}  // namespace dtr::stereo
