#include "calib/bundle/plain/minimise_bundle.h"

#include <algorithm>
#include <cmath>

#include "calib/bundle/observation_rows.h"
#include "calib/bundle/plain/plain_adjust.h"
#include "calib/lens_groups.h"

namespace dtr::calib {
namespace {

// A step that promises less than this share of the cost is the last. Least squares converges
// quadratically where residuals are small, so that what is then left is far less still.
constexpr double kRobustTolerance = 1e-6, kLeastSquaresTolerance = 1e-11;
constexpr int kMaxSteps = 100;
// Steps of a robust solve may be wide; those of least squares start where that ended.
constexpr double kRobustLambda = 1e-4, kLeastSquaresLambda = 1e-6;

plain::Settings SettingsOf(const Bundle& bundle, const std::vector<LensCamera>& known,
                           const AdjustOptions& options, double sigma_px, const Normalised& n) {
  plain::Settings settings;
  settings.free_poses = !options.fix_poses;
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const LensCamera& lens = bundle.lenses[i];
    settings.free_params.push_back(FreeParams(lens, options.lens));
    const double centre_px = PrincipalPointSigmaPx(lens, options);
    const int first = FocalCount(lens.model);
    for (int k = first; k < first + 2 && std::isfinite(centre_px); ++k) {
      settings.lens_priors.push_back(
          {i, false, k, known[i].params[static_cast<size_t>(k)], sigma_px / centre_px});
    }
    const double aspect = AspectSigma(lens, options);
    if (std::isfinite(aspect)) {
      const double ratio = std::log(known[i].params[1] / known[i].params[0]);
      settings.lens_priors.push_back({i, true, 0, ratio, sigma_px / aspect});
    }
  }
  for (size_t i = 0; i < n.shift.size(); ++i) {
    const LensCamera& lens = bundle.lenses[static_cast<size_t>(bundle.images[i].lens)];
    settings.shift_weights.push_back(sigma_px /
                                     (kStabiliserShare * std::max(lens.width_px, lens.height_px)));
  }
  return settings;
}

}  // namespace

bool ServesPlain(const Bundle& bundle, const AdjustOptions& options, const Normalised& n) {
  return !options.by_ceres && n.members.empty() && options.positions.empty() &&
         options.distances.empty() &&
         std::all_of(bundle.lenses.begin(), bundle.lenses.end(), IsPlain);
}

plain::MinimiseResult MinimisePlain(const Bundle& bundle, const std::vector<LensCamera>& known,
                                    const AdjustOptions& options, const std::vector<bool>& used,
                                    double sigma_px, double cauchy_px, Normalised& n) {
  plain::Settings settings = SettingsOf(bundle, known, options, sigma_px, n);
  settings.cauchy_px = cauchy_px;
  plain::MinimiseOptions how;
  how.max_iterations = kMaxSteps;
  how.cost_tolerance = cauchy_px > 0 ? kRobustTolerance : kLeastSquaresTolerance;
  how.start_lambda = cauchy_px > 0 ? kRobustLambda : kLeastSquaresLambda;
  how.progress = options.progress;
  plain::Unknowns x{n.theta, n.motion, n.place, n.shift};
  const plain::Problem problem(bundle, n, used, settings);
  const plain::MinimiseResult result = plain::Minimise(problem, how, x);
  n.theta = std::move(x.theta), n.motion = std::move(x.motion);
  n.place = std::move(x.place), n.shift = std::move(x.shift);
  return result;
}

}  // namespace dtr::calib
