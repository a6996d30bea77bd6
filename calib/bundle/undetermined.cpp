#include "calib/bundle/undetermined.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "calib/distributions.h"
#include "calib/models/lens_formula.h"

namespace dtr::calib {
namespace {

// Of the corner's distance from the principal point: distortion that is less surely known is none
// that a photo tells by itself.
constexpr double kMaxCornerSigma = 0.02;

// Where distortion puts the corner of the image, in focal lengths.
Eigen::Vector2d DistortedCorner(const LensCamera& lens, const std::vector<double>& params) {
  const auto formula = FormulaOf(lens.model, params.data());
  const double q[2] = {0.5 * lens.width_px / formula.fx_px, 0.5 * lens.height_px / formula.fy_px};
  Eigen::Vector2d distorted;
  formula.Distort(q, distorted.data());
  return distorted;
}

// Standard deviation of that for the distortion's sake alone, over its length.
double CornerSigma(const LensCamera& lens, const Eigen::MatrixXd& variance) {
  constexpr double kStep = 1e-6;
  const long first = FocalCount(lens.model) + 2, count = variance.rows() - first;
  if (count <= 0) return 0;
  const Eigen::Vector2d corner = DistortedCorner(lens, lens.params);
  Eigen::MatrixXd by_params(2, count);
  for (long k = 0; k < count; ++k) {
    std::vector<double> params = lens.params;
    params[static_cast<size_t>(first + k)] += kStep;
    by_params.col(k) = (DistortedCorner(lens, params) - corner) / kStep;
  }
  const Eigen::Matrix2d moved =
      by_params * variance.bottomRightCorner(count, count) * by_params.transpose();
  return RootOfVariance(moved.trace()) / corner.norm();
}

}  // namespace

std::string NameOfLens(const Bundle& bundle, int lens) {
  std::string name;
  for (const BundleImage& image : bundle.images) {
    if (image.lens != lens) continue;
    if (!name.empty()) return fmt::format("camera {}", lens + 1);
    name = image.name;
  }
  return name.empty() ? fmt::format("camera {}", lens + 1) : name;
}

std::string UndeterminedTerm(const Adjusted& adjusted, const BundleCovariance& covariance,
                             const AdjustOptions& options) {
  const Bundle& bundle = adjusted.bundle;
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const LensCamera& lens = bundle.lenses[i];
    const int index = static_cast<int>(i);
    const Eigen::MatrixXd variance = covariance.OfLens(bundle, index);
    const double corner = CornerSigma(lens, variance);
    if (!(corner <= kMaxCornerSigma)) {
      return fmt::format("distortion of {}, which puts the image's corner to {:.2g} % at best",
                         NameOfLens(bundle, index), 100 * corner);
    }
    const double known_px = PrincipalPointSigmaPx(lens, options);
    if (!std::isfinite(known_px)) continue;
    const long at = FocalCount(lens.model);
    const double sigma_px = RootOfVariance(std::max(variance(at, at), variance(at + 1, at + 1)));
    if (!(sigma_px <= kOpenShare * known_px)) {
      return fmt::format("principal point of {}, known to {:.2g} px at best",
                         NameOfLens(bundle, index), sigma_px);
    }
  }
  return "";
}

}  // namespace dtr::calib
