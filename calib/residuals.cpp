#include "calib/residuals.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/order_statistics.h"

namespace dtr::calib {

int CellOf(double at_px, int size_px, int cells) {
  const double cell = cells * at_px / size_px;
  return cell > 0 ? static_cast<int>(std::min(cell, cells - 1.0)) : 0;
}

ResidualStats Summarise(const std::vector<Eigen::Vector2d>& residuals) {
  ResidualStats stats;
  stats.count = static_cast<int>(residuals.size());
  if (residuals.empty()) return stats;
  std::vector<double> lengths;
  lengths.reserve(residuals.size());
  double squared = 0;
  for (const Eigen::Vector2d& r : residuals) {
    squared += r.squaredNorm();
    stats.mean_px += r;
    lengths.push_back(r.norm());
  }
  const auto count = static_cast<double>(residuals.size());
  stats.mean_px /= count;
  stats.rms_px = std::sqrt(squared / count);
  std::sort(lengths.begin(), lengths.end());
  // Nearest-rank percentiles: the smallest value with at least the share at or below it.
  const auto rank = [&](double share) {
    return lengths[static_cast<size_t>(std::max(0.0, std::ceil(share * count) - 1))];
  };
  stats.median_px = rank(0.5);
  stats.p95_px = rank(0.95);
  stats.worst_px = lengths.back();
  return stats;
}

double CauchyLoss(double residual_px, double scale_px) {
  return scale_px * scale_px * std::log1p(std::pow(residual_px / scale_px, 2));
}

LossDecrease DecreaseOfLoss(const std::vector<double>& before_px,
                            const std::vector<double>& after_px, double scale_px) {
  double sum = 0, squares = 0;
  for (size_t i = 0; i < before_px.size(); ++i) {
    const double fell = CauchyLoss(before_px[i], scale_px) - CauchyLoss(after_px[i], scale_px);
    sum += fell;
    squares += fell * fell;
  }
  const auto n = static_cast<double>(before_px.size());
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / n)};
}

}  // namespace dtr::calib
