#include "calib/bundle/plain/plain_adjust.h"

#include <algorithm>

#include "calib/bundle/normalised.h"
#include "calib/bundle/plain/minimise.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

[[noreturn]] void RejectPlain(const std::string& what) {
  throw Error("bundle adjustment: " + what);
}

void CheckPlain(const Bundle& bundle, const PlainOptions& options, const std::vector<bool>& used) {
  CheckBundle(bundle);
  const auto fits = [](const std::vector<bool>& list, size_t count) {
    return list.empty() || list.size() == count;
  };
  if (!fits(options.fixed_lenses, bundle.lenses.size()) ||
      !fits(options.fixed_images, bundle.images.size()) ||
      (!options.known_focals_px.empty() &&
       options.known_focals_px.size() != bundle.lenses.size()) ||
      !fits(used, bundle.observations.size())) {
    RejectPlain("a list of what is fixed or used must have an entry for each");
  }
  if (!std::all_of(bundle.lenses.begin(), bundle.lenses.end(), IsPlain)) {
    RejectPlain(
        "only perspective camera models up to OPENCV and radial fisheyes can be adjusted without "
        "Ceres");
  }
  if (options.principal_point_sigma_px > 0 && !options.free_poses) {
    RejectPlain("principal points per image: expected poses that may move");
  }
}

std::vector<int> FreeParamsOf(const LensCamera& lens, const PlainOptions& options) {
  std::vector<int> free;
  const int focals = FocalCount(lens.model);
  for (int k = 0; k < ParameterCount(lens.model); ++k) {
    const bool moves = k < focals       ? options.free_focal
                       : k < focals + 2 ? options.free_principal_point
                                        : options.free_distortion;
    if (moves) free.push_back(k);
  }
  return free;
}

std::vector<plain::LensPrior> FocalPriors(const Bundle& bundle, const PlainOptions& options) {
  std::vector<plain::LensPrior> priors;
  for (size_t i = 0; i < options.known_focals_px.size() && options.free_focal; ++i) {
    if (!options.fixed_lenses.empty() && options.fixed_lenses[i]) continue;
    const std::vector<double>& known_px = options.known_focals_px[i];
    const auto focals = static_cast<size_t>(FocalCount(bundle.lenses[i].model));
    for (size_t k = 0; k < std::min(focals, known_px.size()); ++k) {
      if (!(known_px[k] > 0)) RejectPlain("a known focal length must be positive");
      priors.push_back({i, false, static_cast<int>(k), known_px[k],
                        1 / (options.focal_sigma_share * known_px[k])});
    }
  }
  return priors;
}

}  // namespace

bool IsPlain(const LensCamera& lens) { return plain::HasIntrinsics(lens.model); }

PlainResult AdjustPlain(const PlainOptions& options, const std::vector<bool>& used,
                        Bundle& bundle) {
  CheckPlain(bundle, options, used);
  Normalised n = Normalised::Around(bundle);
  plain::Settings settings;
  settings.free_poses = options.free_poses;
  settings.fixed_images = options.fixed_images;
  settings.cauchy_px = options.cauchy_px;
  settings.lens_priors = FocalPriors(bundle, options);
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const bool fixed = !options.fixed_lenses.empty() && options.fixed_lenses[i];
    settings.free_params.push_back(fixed ? std::vector<int>{}
                                         : FreeParamsOf(bundle.lenses[i], options));
  }
  if (options.principal_point_sigma_px > 0) {
    n.shift.assign(bundle.images.size(), {});
    settings.shift_weights.assign(bundle.images.size(), 1 / options.principal_point_sigma_px);
  }
  std::vector<bool> counts(bundle.observations.size());
  Eigen::Vector2d residual;
  for (size_t i = 0; i < counts.size(); ++i) {
    counts[i] = (used.empty() || used[i]) && n.Residual(bundle, bundle.observations[i], &residual);
  }
  if (std::none_of(counts.begin(), counts.end(), [](bool c) { return c; })) {
    RejectPlain("expected points in front of the cameras that see them, found none");
  }
  plain::MinimiseOptions how;
  how.max_iterations = options.max_iterations;
  how.cost_tolerance = options.cost_tolerance;
  how.progress = options.progress;
  plain::Unknowns x{n.theta, n.motion, n.place, n.shift};
  const plain::Problem problem(bundle, n, counts, settings);
  const plain::MinimiseResult found = plain::Minimise(problem, how, x);
  n.theta = std::move(x.theta), n.motion = std::move(x.motion);
  n.place = std::move(x.place), n.shift = std::move(x.shift);
  bundle = n.LocalAt(bundle);
  n.ToWorld(bundle);
  return {found.start_cost, found.cost, found.iterations, found.converged};
}

}  // namespace dtr::calib
