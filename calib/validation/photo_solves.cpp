#include "calib/validation/photo_solves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "calib/bundle/parts.h"
#include "calib/distributions.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

constexpr double kHeldAspectSigma = 1e-4;  // of the logarithm of fy / fx: as good as fixed
constexpr std::uint64_t kHalfDraw = 0x4a1f;

AdjustOptions AllFree() {
  AdjustOptions options;
  options.lens = LensFreedom::kAll;
  options.principal_point_share = kKnownPrincipalPointShare;
  options.aspect_sigma = kKnownAspectSigma;
  return options;
}

// What of lenses the observations do not determine well beyond what was known before.
std::vector<Degeneracy> OpenIntrinsics(const Adjusted& fresh, const BundleCovariance& covariance,
                                       const AdjustOptions& options, std::vector<int>& centres) {
  std::vector<Degeneracy> open;
  for (size_t i = 0; i < fresh.bundle.lenses.size(); ++i) {
    const LensCamera& lens = fresh.bundle.lenses[i];
    const Eigen::MatrixXd variance = covariance.OfLens(fresh.bundle, static_cast<int>(i));
    const auto add = [&](const char* name, const std::string& what, double sigma, double known,
                         const char* unit) {
      if (sigma <= kOpenShare * known) return false;
      open.push_back({name,
                      fmt::format("the observations determine {} of camera {} to {:.2g}{} at best, "
                                  "as on an orbit at one height; the stored one is taken as right",
                                  what, i + 1, sigma, unit),
                      false});
      return true;
    };
    const long at = FocalCount(lens.model);
    const bool open_centre =
        add("open_principal_point", "the principal point",
            RootOfVariance(std::max(variance(at, at), variance(at + 1, at + 1))),
            PrincipalPointSigmaPx(lens, options), " px");
    if (open_centre) centres.push_back(static_cast<int>(i));
    const double known = AspectSigma(lens, options);
    if (!std::isfinite(known)) continue;
    const Eigen::Vector2d by(-1 / lens.params[0], 1 / lens.params[1]);
    const Eigen::Matrix2d of_focals = variance.topLeftCorner<2, 2>();
    add("open_aspect_ratio", "the ratio of the focal lengths",
        RootOfVariance(by.dot(of_focals * by)), known, "");
  }
  return open;
}

FreshSolves SolveWith(const Bundle& stored, const Halves& halves, const AdjustOptions& options) {
  FreshSolves fresh;
  fresh.options = options;
  ParallelFor(0, halves.parts.empty() ? 1 : 3, [&](int i) {
    fresh.solved[i] = Adjust(i == 0 ? stored : halves.parts[static_cast<size_t>(i) - 1], options);
  });
  fresh.covariance = CovarianceOf(fresh.solved[0], options);
  return fresh;
}

}  // namespace

Halves HalvesOf(const Bundle& stored) {
  Halves halves;
  const Bundle enough = WithoutWeakImages(stored, kMinObservationsOfHalf);
  for (const BundleImage& image : stored.images) {
    const bool kept =
        std::any_of(enough.images.begin(), enough.images.end(),
                    [&](const BundleImage& other) { return other.name == image.name; });
    if (!kept) halves.left_out += (halves.left_out.empty() ? "" : ", ") + image.name;
  }
  if (enough.images.size() < 2) return halves;
  for (const std::uint64_t half : {0, 1}) {
    halves.parts.push_back(
        WithPoints(enough, [&](std::uint64_t p) { return (HashOf(p, kHalfDraw) & 1) == half; }));
  }
  return halves;
}

FreshSolves SolveAfresh(const Bundle& stored, const Halves& halves, const Progress* progress) {
  AdjustOptions options = AllFree();
  options.progress = progress;
  FreshSolves free = SolveWith(stored, halves, options);
  if (!free.covariance.computed) return free;
  const bool usable = free.covariance.determined && free.solved[0].converged;
  if (usable) {
    free.open = OpenIntrinsics(free.solved[0], free.covariance, options, free.open_centres);
  } else {
    free.open_centres.resize(stored.lenses.size());
    std::iota(free.open_centres.begin(), free.open_centres.end(), 0);
  }
  if (usable && free.open.empty()) return free;
  const auto holds = [&](const char* name) {
    return !usable || std::any_of(free.open.begin(), free.open.end(),
                                  [&](const Degeneracy& d) { return d.name == name; });
  };
  if (holds("open_principal_point")) options.lens = LensFreedom::kNoPrincipalPoint;
  if (holds("open_aspect_ratio")) options.aspect_sigma = kHeldAspectSigma;
  FreshSolves held = SolveWith(stored, halves, options);
  held.open = std::move(free.open);
  held.open_centres = std::move(free.open_centres);
  if (!usable && held.covariance.determined && held.solved[0].converged) {
    held.open.push_back({"open_principal_point",
                         "the observations do not determine the principal point, as on an orbit at "
                         "one height; the stored one is taken as right",
                         false});
  }
  return held;
}

}  // namespace dtr::calib
