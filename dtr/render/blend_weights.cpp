#include "dtr/render/blend_weights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace dtr {
namespace {

constexpr double kNoWeight = -std::numeric_limits<double>::infinity();

// SPEC 4.8: stands for the other views where there are none.
constexpr double kMinOthers = 1e-6;

double LogOrNone(double weight) { return weight > 0 ? std::log(weight) : kNoWeight; }

double Power(double base, int exponent) {
  double power = 1;
  for (; exponent > 0; exponent /= 2, base *= base) {
    if (exponent % 2 == 1) power *= base;
  }
  return power;
}

/// The default weight, divided by the largest before it is raised: in no danger at any k, and
/// without a logarithm and an exponential for every view of every pixel.
void InverseAngleWeights(const BlendParameters& parameters, std::span<const double> angles_rad,
                         std::span<double> weights) {
  const double smallest =
      *std::min_element(angles_rad.begin(), angles_rad.end()) + parameters.pixel_angle_rad;
  for (size_t i = 0; i < angles_rad.size(); ++i) {
    weights[i] = Power(smallest / (angles_rad[i] + parameters.pixel_angle_rad), parameters.blend_k);
  }
}

void DivideBySum(std::span<double> shares) {
  double sum = 0;
  for (const double share : shares) sum += share;
  for (double& share : shares) share /= sum;
}

}  // namespace

BlendParameters BlendParametersOf(const RenderOptions& options, double novel_fx_px,
                                  const Bounds& bounds) {
  const double diagonal = bounds.empty() ? 0 : (bounds.max - bounds.min).norm();
  return {options.blend,
          options.exponent,
          options.falloff,
          options.blend_k,
          options.max_angle_rad,
          std::atan2(1.0, novel_fx_px),
          diagonal > 0 ? 1 / diagonal : 0};
}

double LogWeight(const BlendParameters& parameters, double angle_rad, double next_angle_rad) {
  switch (parameters.blend) {
    case BlendWeight::kCosine:
      if (angle_rad >= std::numbers::pi / 2) return kNoWeight;
      return parameters.exponent * std::log(std::cos(angle_rad));
    case BlendWeight::kExponential:
      return -parameters.falloff * angle_rad;
    case BlendWeight::kAngle:
      return LogOrNone(1 - angle_rad / parameters.max_angle_rad);
    case BlendWeight::kInverseAngle:
      return -parameters.blend_k * std::log(angle_rad + parameters.pixel_angle_rad);
    case BlendWeight::kKNearest:
      return next_angle_rad > 0 ? LogOrNone(1 - angle_rad / next_angle_rad) : kNoWeight;
  }
  return kNoWeight;
}

double NextAngle(const BlendParameters& parameters, std::span<const double> angles_rad) {
  const auto k = static_cast<size_t>(parameters.blend_k);
  if (angles_rad.size() <= k) return parameters.max_angle_rad;
  std::vector<double> sorted(angles_rad.begin(), angles_rad.end());
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(k), sorted.end());
  return sorted[k];
}

int BlendShares(const BlendParameters& parameters, std::span<const double> angles_rad,
                std::span<double> shares) {
  if (angles_rad.empty()) return 0;
  shares = shares.first(angles_rad.size());
  if (parameters.blend == BlendWeight::kInverseAngle) {
    InverseAngleWeights(parameters, angles_rad, shares);
    DivideBySum(shares);
    return static_cast<int>(shares.size());
  }
  const double next_angle =
      parameters.blend == BlendWeight::kKNearest ? NextAngle(parameters, angles_rad) : 0;
  int positive = 0;
  double largest = kNoWeight;
  for (size_t i = 0; i < angles_rad.size(); ++i) {
    shares[i] = LogWeight(parameters, angles_rad[i], next_angle);
    if (shares[i] > kNoWeight) ++positive;
    largest = std::max(largest, shares[i]);
  }
  if (positive == 0) {  // SPEC 4.6: the best view wins, equal ones share
    const double smallest = *std::min_element(angles_rad.begin(), angles_rad.end());
    positive = static_cast<int>(std::count(angles_rad.begin(), angles_rad.end(), smallest));
    for (size_t i = 0; i < angles_rad.size(); ++i) {
      shares[i] = angles_rad[i] == smallest ? 1.0 / positive : 0.0;
    }
    return positive;
  }
  for (double& share : shares) share = std::exp(share - largest);
  DivideBySum(shares);
  return positive;
}

void FadeShares(std::span<const double> factors, std::span<double> shares) {
  bool fades = false;
  for (size_t i = 0; i < shares.size(); ++i) {
    fades = fades || factors[i] < 1;
    const double others = 1 - shares[i] + kMinOthers;
    shares[i] *= factors[i] * others / (others + (1 - factors[i]) * shares[i]);
  }
  if (fades) DivideBySum(shares);
}

}  // namespace dtr
