// calib/residuals.h -- residuals of observations, and what they amount to.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace dtr::calib {

/// Residuals in pixels: observed minus predicted.
struct ResidualStats {
  int count = 0;
  double rms_px = 0;  ///< root of the mean squared length of the residual vectors
  double median_px = 0, p95_px = 0, worst_px = 0;     ///< of the lengths
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();  ///< of the vectors: what is systematic
};

/// Where something was seen, and its residual there: predicted less observed, the other sign than
/// ResidualStats.
struct ResidualArrow {
  Eigen::Vector2d pixel, residual_px;
};

/// A point of a view, and how uncertain it is where two other views place it: standard deviation
/// per axis, px.
struct PlacedPixel {
  Eigen::Vector2d pixel;
  double sigma_px = 0;
};

/// Number of image regions per axis.
inline constexpr int kRegionsPerAxis = 3;

/// Which of `cells` equal parts of [0, size_px) holds `at_px`; the nearest one for a number off it,
/// however large, and the first for NaN.
int CellOf(double at_px, int size_px, int cells);

/// Percentiles by nearest rank: the smallest length with at least the share at or below it.
ResidualStats Summarise(const std::vector<Eigen::Vector2d>& residuals);

/// Cauchy's loss of a residual: scale^2 log(1 + (residual / scale)^2), px^2.
double CauchyLoss(double residual_px, double scale_px);

/// How far the mean loss of the same observations fell, px^2.
struct LossDecrease {
  double mean = 0;
  double deviation = 0;  ///< standard deviation of the mean
};
LossDecrease DecreaseOfLoss(const std::vector<double>& before_px,
                            const std::vector<double>& after_px, double scale_px);

}  // namespace dtr::calib
