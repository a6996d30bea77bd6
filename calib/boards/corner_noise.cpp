#include "calib/boards/corner_noise.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr double kRoundingLevels = 0.2887;   // of whole grey levels: 1 / sqrt(12)
constexpr double kMedianOfNormal = 0.67449;  // of |x| for a standard normal x
constexpr double kMaskGain = 6;              // root of the sum of squares of Immerkaer's mask
constexpr double kMinConditioned = 1e-3;     // smaller over larger eigenvalue: an edge, no corner
constexpr size_t kMinNoisyCorners = 4;

Eigen::Vector2d GradientAt(const Grid<std::uint8_t>& grey, int x, int y) {
  return {0.5 * (grey(x + 1, y) - grey(x - 1, y)), 0.5 * (grey(x, y + 1) - grey(x, y - 1))};
}

// Sum of the squared derivatives of a corner's coordinates by the grey values around it, both
// coordinates together.
std::optional<double> SquaredGain(const Grid<std::uint8_t>& grey, const Eigen::Vector2d& corner,
                                  int half_window_px) {
  const int left = static_cast<int>(std::floor(corner.x())) - half_window_px;
  const int top = static_cast<int>(std::floor(corner.y())) - half_window_px;
  const int side = 2 * half_window_px + 1;
  if (!grey.Contains(left - 1, top - 1) || !grey.Contains(left + side, top + side)) return {};
  // Derivatives of the right-hand side of A dq = ..., per pixel of the window and its rim.
  Grid<double> by_pixel(side + 2, side + 2, 2, 0.0);
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const Eigen::Vector2d way = Eigen::Vector2d(left + x + 0.5, top + y + 0.5) - corner;
      const Eigen::Vector2d g = GradientAt(grey, left + x, top + y);
      const double weight =
          std::exp(-way.squaredNorm() / (static_cast<double>(half_window_px) * half_window_px));
      normal += weight * g * g.transpose();
      // d(g g^T way) by g: g way^T dg + (g . way) dg; dg is half a difference of two pixels.
      const Eigen::Matrix2d by_gradient =
          weight * (g * way.transpose() + g.dot(way) * Eigen::Matrix2d::Identity());
      for (int c = 0; c < 2; ++c) {
        by_pixel(x + 2, y + 1, c) += 0.5 * by_gradient(c, 0);
        by_pixel(x, y + 1, c) -= 0.5 * by_gradient(c, 0);
        by_pixel(x + 1, y + 2, c) += 0.5 * by_gradient(c, 1);
        by_pixel(x + 1, y, c) -= 0.5 * by_gradient(c, 1);
      }
    }
  }
  const double half_trace = 0.5 * normal.trace();
  const double spread = std::sqrt(std::max(0.0, half_trace * half_trace - normal.determinant()));
  if (!(half_trace - spread > kMinConditioned * (half_trace + spread))) return {};
  const Eigen::Matrix2d inverse = normal.inverse();
  double sum = 0;
  for (int y = 0; y < side + 2; ++y) {
    for (int x = 0; x < side + 2; ++x) {
      sum += (inverse * Eigen::Vector2d(by_pixel(x, y, 0), by_pixel(x, y, 1))).squaredNorm();
    }
  }
  return sum;
}

}  // namespace

double PixelNoise(const Grid<std::uint8_t>& grey, std::span<const BoardCorner> corners) {
  Eigen::Vector2d low(1, 1), high(grey.width() - 1, grey.height() - 1);
  if (!corners.empty()) {
    Eigen::Vector2d first = corners[0].pixel, last = corners[0].pixel;
    for (const BoardCorner& corner : corners) {
      first = first.cwiseMin(corner.pixel);
      last = last.cwiseMax(corner.pixel);
    }
    low = low.cwiseMax(first);
    high = high.cwiseMin(last);
  }
  std::vector<double> answers;
  for (int y = static_cast<int>(low.y()); y < static_cast<int>(high.y()); ++y) {
    for (int x = static_cast<int>(low.x()); x < static_cast<int>(high.x()); ++x) {
      const double answer = grey(x - 1, y - 1) - 2 * grey(x, y - 1) + grey(x + 1, y - 1) -
                            2 * grey(x - 1, y) + 4 * grey(x, y) - 2 * grey(x + 1, y) +
                            grey(x - 1, y + 1) - 2 * grey(x, y + 1) + grey(x + 1, y + 1);
      answers.push_back(std::abs(answer));
    }
  }
  if (answers.empty()) return kRoundingLevels;
  return std::max(UpperMedian(answers) / (kMedianOfNormal * kMaskGain), kRoundingLevels);
}

double CornerNoise(const Grid<std::uint8_t>& grey, std::span<const BoardCorner> corners,
                   int half_window_px) {
  std::vector<double> gains;
  for (const BoardCorner& corner : corners) {
    if (const auto gain = SquaredGain(grey, corner.pixel, half_window_px)) {
      gains.push_back(std::sqrt(0.5 * *gain));
    }
  }
  if (gains.size() < kMinNoisyCorners) return std::numeric_limits<double>::quiet_NaN();
  return PixelNoise(grey, corners) * UpperMedian(gains);
}

}  // namespace dtr::calib
