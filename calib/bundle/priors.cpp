#include "calib/bundle/priors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "calib/lens_groups.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

[[noreturn]] void RejectPrior(const std::string& what) {
  throw Error("bundle adjustment: " + what);
}

// (centre - known) / sigma, in units of an observation's sigma so that both sums can be added.
struct PositionCost {
  Eigen::Vector3d offset, weight;  // of the normalised centre
  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = weight[i] * (motion[3 + i] + offset[i]);
    return true;
  }
};

struct DistanceCost {
  Eigen::Vector3d a, b;
  double distance, weight;
  template <typename T>
  bool operator()(const T* motion_a, const T* motion_b, T* residual) const {
    T d[3];
    for (int i = 0; i < 3; ++i) d[i] = a[i] + motion_a[3 + i] - b[i] - motion_b[3 + i];
    const T squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (!(squared > T(0))) return false;
    residual[0] = weight * (sqrt(squared) - distance);
    return true;
  }
};

// An image's shift, in units of its standard deviation and of an observation's.
struct ShiftCost {
  Eigen::Vector2d start_px;
  double scale_px, weight;
  template <typename T>
  bool operator()(const T* shift, T* residual) const {
    for (int i = 0; i < 2; ++i) residual[i] = weight * (start_px[i] + scale_px * shift[i]);
    return true;
  }
};

// A lens's principal point, likewise, from the third on of its unknowns or the second.
struct PrincipalPointCost {
  int first;
  double weight;              // of one unit of the unknowns
  std::array<double, 2> off;  // of the start, in these units
  template <typename T>
  bool operator()(T const* const* theta, T* residual) const {
    for (int i = 0; i < 2; ++i) {
      residual[i] = weight * (theta[0][first + i] + off[static_cast<size_t>(i)]);
    }
    return true;
  }
};

// The logarithm of fy / fx less that which is known.
struct AspectCost {
  double fx_px, fy_px, scale_px, weight, off;
  template <typename T>
  bool operator()(T const* const* theta, T* residual) const {
    const T fx = 1.0 + scale_px / fx_px * theta[0][0], fy = 1.0 + scale_px / fy_px * theta[0][1];
    if (!(fx > T(0)) || !(fy > T(0))) return false;
    residual[0] = weight * (log(fy) - log(fx) + off);
    return true;
  }
};

template <typename Functor>
void AddLensCost(const Functor& functor, int residuals, const LensFrame& lens, double* theta,
                 ceres::Problem& problem) {
  auto* cost = new ceres::DynamicAutoDiffCostFunction<Functor>(new Functor(functor));
  cost->AddParameterBlock(static_cast<int>(lens.centre.size()));
  cost->SetNumResiduals(residuals);
  problem.AddResidualBlock(cost, nullptr, theta);
}

// Of a lens with two focal lengths.
double LogAspect(const std::vector<double>& params) { return std::log(params[1] / params[0]); }

void AddLensPriors(const Bundle& bundle, const std::vector<LensCamera>& known_lenses,
                   const AdjustOptions& options, double sigma_px, Normalised& n,
                   ceres::Problem& problem) {
  for (size_t i = 0; i < n.theta.size(); ++i) {
    if (!problem.HasParameterBlock(n.theta[i].data())) continue;
    const LensFrame& lens = n.lenses[i];
    const double known_px = PrincipalPointSigmaPx(bundle.lenses[i], options);
    if (std::isfinite(known_px)) {
      const int first = FocalCount(lens.model);
      const auto k = static_cast<size_t>(first);
      const double weight = sigma_px / known_px * lens.scale[k];
      const std::vector<double>& there = known_lenses[i].params;
      const std::array<double, 2> off{(lens.centre[k] - there[k]) / lens.scale[k],
                                      (lens.centre[k + 1] - there[k + 1]) / lens.scale[k]};
      AddLensCost(PrincipalPointCost{first, weight, off}, 2, n.lenses[i], n.theta[i].data(),
                  problem);
    }
    const double known = AspectSigma(bundle.lenses[i], options);
    if (std::isfinite(known)) {
      const double off = LogAspect(lens.centre) - LogAspect(known_lenses[i].params);
      AddLensCost(AspectCost{lens.centre[0], lens.centre[1], lens.scale[0], sigma_px / known, off},
                  1, n.lenses[i], n.theta[i].data(), problem);
    }
  }
}

void AddShiftPriors(const Bundle& bundle, double sigma_px, Normalised& n, ceres::Problem& problem) {
  for (size_t i = 0; i < n.shift.size(); ++i) {
    if (!problem.HasParameterBlock(n.shift[i].data())) continue;
    const BundleImage& image = bundle.images[i];
    const LensCamera& lens = bundle.lenses[static_cast<size_t>(image.lens)];
    const double known_px = kStabiliserShare * std::max(lens.width_px, lens.height_px);
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<ShiftCost, 2, 2>(new ShiftCost{
                                 image.shift_px, n.ShiftScalePx(bundle, i), sigma_px / known_px}),
                             nullptr, n.shift[i].data());
  }
}

void AddPlacePriors(const AdjustOptions& options, double sigma_px, Normalised& n,
                    ceres::Problem& problem) {
  for (const PositionPrior& p : options.positions) {
    const auto i = static_cast<size_t>(p.image);
    const Eigen::Vector3d weight = sigma_px * n.unit * p.sigma.cwiseInverse();
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PositionCost, 3, 6>(new PositionCost{
                                 n.poses[i].centre - (p.centre - n.origin) / n.unit, weight}),
                             nullptr, n.motion[i].data());
  }
  for (const DistancePrior& d : options.distances) {
    const auto a = static_cast<size_t>(d.image_a), b = static_cast<size_t>(d.image_b);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<DistanceCost, 1, 6, 6>(
            new DistanceCost{n.poses[a].centre, n.poses[b].centre, d.distance / n.unit,
                             sigma_px * n.unit / d.sigma}),
        nullptr, n.motion[a].data(), n.motion[b].data());
  }
}

}  // namespace

void CheckPriors(const Bundle& bundle, const AdjustOptions& options) {
  const auto images = static_cast<int>(bundle.images.size());
  const auto known = [images](int i) { return i >= 0 && i < images; };
  for (const PositionPrior& p : options.positions) {
    if (!known(p.image) || !p.centre.allFinite() || !(p.sigma.array() > 0).all() ||
        !p.sigma.allFinite()) {
      RejectPrior("expected known positions of its images, finite and with sigmas above 0");
    }
  }
  for (const DistancePrior& d : options.distances) {
    if (!known(d.image_a) || !known(d.image_b) || d.image_a == d.image_b || !(d.distance > 0) ||
        !(d.sigma > 0) || !std::isfinite(d.distance + d.sigma)) {
      RejectPrior(
          "expected known distances between two of its images, above 0 and with sigmas above 0");
    }
  }
}

void AddPriors(const Bundle& bundle, const std::vector<LensCamera>& known,
               const AdjustOptions& options, double sigma_px, Normalised& n,
               ceres::Problem& problem) {
  AddPlacePriors(options, sigma_px, n, problem);
  AddShiftPriors(bundle, sigma_px, n, problem);
  AddLensPriors(bundle, known, options, sigma_px, n, problem);
}

double PriorSquares(const std::vector<LensCamera>& known_lenses, const Bundle& bundle,
                    const AdjustOptions& options, double* numbers) {
  const auto centre = [&](int image) {
    return bundle.images[static_cast<size_t>(image)].cam_from_world.TargetOriginInSource();
  };
  double squares = 0;
  for (const PositionPrior& p : options.positions) {
    squares += (centre(p.image) - p.centre).cwiseQuotient(p.sigma).squaredNorm();
  }
  for (const DistancePrior& d : options.distances) {
    squares += std::pow(((centre(d.image_a) - centre(d.image_b)).norm() - d.distance) / d.sigma, 2);
  }
  *numbers = 3 * static_cast<double>(options.positions.size()) +
             static_cast<double>(options.distances.size());
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const double known_px = PrincipalPointSigmaPx(bundle.lenses[i], options);
    if (!std::isfinite(known_px)) continue;
    const auto at = static_cast<size_t>(FocalCount(bundle.lenses[i].model));
    for (size_t k = at; k < at + 2; ++k) {
      squares += std::pow((bundle.lenses[i].params[k] - known_lenses[i].params[k]) / known_px, 2);
    }
    *numbers += 2;
  }
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const double known = AspectSigma(bundle.lenses[i], options);
    if (!std::isfinite(known)) continue;
    const double off = LogAspect(bundle.lenses[i].params) - LogAspect(known_lenses[i].params);
    squares += std::pow(off / known, 2);
    *numbers += 1;
  }
  return squares;
}

double PrincipalPointSigmaPx(const LensCamera& lens, const AdjustOptions& options) {
  if (!(options.principal_point_share > 0) || !FreesPrincipalPoint(options.lens)) {
    return std::numeric_limits<double>::infinity();
  }
  return options.principal_point_share * std::max(lens.width_px, lens.height_px);
}

double AspectSigma(const LensCamera& lens, const AdjustOptions& options) {
  if (!(options.aspect_sigma > 0) || options.lens == LensFreedom::kFixed ||
      FocalCount(lens.model) < 2) {
    return std::numeric_limits<double>::infinity();
  }
  return options.aspect_sigma;
}

}  // namespace dtr::calib
