#include "calib/bundle/held_out.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

constexpr int kResamples = 1000;
constexpr double kConfidence = 0.95;
constexpr std::uint64_t kPick = 0x401d, kBoot = 0xb007, kSome = 0x50e, kHalf = 0x8a1f;

std::uint64_t IdOf(const Bundle& bundle, const BundleObservation& o) {
  return bundle.point_ids[static_cast<size_t>(o.point)];
}

/// `asked` with these cameras, its points where they explain them best.
Adjusted Placed(const Bundle& cameras, const Bundle& asked) {
  Bundle placed = asked;
  placed.lenses = cameras.lenses;
  placed.images = cameras.images;
  placed.points = cameras.points;
  return Adjust(placed, OptionsFor({}));
}

}  // namespace

Bundle SomePoints(const Bundle& bundle, int most, std::uint64_t seed) {
  const double share = static_cast<double>(most) / static_cast<double>(bundle.points.size());
  if (share >= 1) return bundle;
  Bundle some = bundle;
  std::erase_if(some.observations, [&](const BundleObservation& o) {
    return UniformFromHash(HashOf(seed, kSome, IdOf(bundle, o))) >= share;
  });
  return some;
}

AdjustOptions OptionsFor(const std::optional<LensFreedom>& lens) {
  AdjustOptions options;
  options.fix_poses = !lens;
  options.lens = lens.value_or(LensFreedom::kFixed);
  return options;
}

std::vector<PointFold> PointFolds(const Bundle& bundle, std::uint64_t seed) {
  Bundle halves[2] = {bundle, bundle};
  for (const std::uint64_t half : {0, 1}) {
    std::erase_if(halves[half].observations, [&](const BundleObservation& o) {
      return (HashOf(seed, kHalf, IdOf(bundle, o)) & 1) != half;
    });
  }
  return {{halves[0], halves[1]}, {halves[1], halves[0]}};
}

std::vector<double> LossesOfHeldOutPoints(const Bundle& cameras, const Bundle& asked,
                                          double scale_px, double* sigma_px) {
  const Adjusted placed = Placed(cameras, asked);
  if (sigma_px != nullptr) *sigma_px = placed.sigma_px;
  const std::vector<Eigen::Vector2d> residuals = Residuals(placed.bundle);
  const auto& all = asked.observations;
  std::vector<double> losses;
  for (size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    double sum = 0;
    for (end = begin; end < all.size() && all[end].point == all[begin].point; ++end) {
      sum += CauchyLoss(residuals[end], scale_px);
    }
    if (end - begin >= kMinTrack) losses.push_back(sum / static_cast<double>(end - begin));
  }
  return losses;
}

ObservationSplit SplitObservations(const Bundle& bundle, std::uint64_t seed) {
  ObservationSplit split{bundle, {}};
  split.training.observations.clear();
  const auto& all = bundle.observations;
  for (size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && all[end].point == all[begin].point) ++end;
    size_t picked = end;  // none
    if (end - begin >= kMinTrack) {
      Random random(HashOf(seed, kPick, IdOf(bundle, all[begin])));
      picked = begin + static_cast<size_t>(random.Index(static_cast<int>(end - begin)));
    }
    for (size_t i = begin; i < end; ++i) {
      (i == picked ? split.held_out : split.training.observations).push_back(all[i]);
    }
  }
  return split;
}

std::vector<double> LossesOfHeldOutObservations(const Bundle& cameras,
                                                const ObservationSplit& split, double scale_px) {
  Bundle asked = Placed(cameras, split.training).bundle;
  asked.observations = split.held_out;
  std::vector<double> losses;
  for (const Eigen::Vector2d& residual : Residuals(asked)) {
    losses.push_back(CauchyLoss(residual, scale_px));
  }
  return losses;
}

double CauchyLoss(const Eigen::Vector2d& residual_px, double scale_px) {
  const double c2 = scale_px * scale_px;
  const double squared = residual_px.allFinite() ? residual_px.squaredNorm() : 1e4 * c2;
  return c2 * std::log1p(squared / c2);
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

std::pair<double, double> BootstrapOfDifference(const std::vector<double>& a,
                                                const std::vector<double>& b, std::uint64_t seed) {
  Random random(HashOf(seed, kBoot));
  std::vector<double> means(kResamples);
  for (double& mean : means) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) {
      const auto k = static_cast<size_t>(random.Index(static_cast<int>(a.size())));
      sum += a[k] - b[k];
    }
    mean = sum / static_cast<double>(a.size());
  }
  std::sort(means.begin(), means.end());
  const double tail = 0.5 * (1 - kConfidence) * (kResamples - 1);
  return {means[static_cast<size_t>(tail)],
          means[static_cast<size_t>(kResamples - 1 - static_cast<int>(tail))]};
}

}  // namespace dtr::calib
