#include "calib/bundle/adjust.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>

#include "calib/bundle/gauge.h"
#include "calib/bundle/lens_params.h"
#include "calib/bundle/normalised.h"
#include "calib/bundle/observation_rows.h"
#include "calib/bundle/parallax.h"
#include "calib/bundle/plain/minimise_bundle.h"
#include "calib/bundle/priors.h"
#include "calib/bundle/rig_adjust.h"
#include "calib/solve/board_start.h"
#include "calib/solve/solver_ends.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

constexpr double kSameScale = 0.05;  // relative change at which the robust loss is settled
constexpr double kCauchySigmas = 2;  // scale of the robust loss
constexpr int kMaxRobustPasses = 5, kMaxOutlierPasses = 4;
constexpr size_t kDenseImages = 100;  // up to here the cameras' system is solved as a dense one

[[noreturn]] void Reject(const std::string& what) { throw Error("bundle adjustment: " + what); }

// Observations nearer than `limit_px` to their predictions.
std::vector<bool> Within(const std::vector<Eigen::Vector2d>& residuals, double limit_px) {
  std::vector<bool> within;
  for (const Eigen::Vector2d& r : residuals) within.push_back(r.allFinite() && r.norm() < limit_px);
  return within;
}

// How many of these observations each point has.
std::vector<int> ObservationsOfPoints(const Bundle& bundle, const std::vector<bool>& counts) {
  std::vector<int> observations(bundle.points.size());
  for (size_t i = 0; i < counts.size(); ++i) {
    observations[static_cast<size_t>(bundle.observations[i].point)] += counts[i];
  }
  return observations;
}

// What a point that moves to where its `observations` want it leaves of their residuals: of two
// observations' four coordinates one is left, which both share, so that their lengths follow a
// normal law of one dimension, and the third smallest of them is smaller still than the share of
// the squares says.
double ShareOfLength(int observations) {
  constexpr double kOfTwo = 0.338;  // 0.4307 / sqrt(2) over 0.9005: lower terciles of the two laws
  return observations == 2 ? kOfTwo : std::sqrt(1 - 1.5 / observations);
}

// Standard deviation of an observation's coordinate. Without regard to what points take up, tracks
// of two would make it far too small; under the robust loss their points would then settle on one
// of the two observations, and make it smaller still.
double SigmaOf(const Bundle& bundle, const std::vector<Eigen::Vector2d>& residuals) {
  const std::vector<int> observations =
      ObservationsOfPoints(bundle, Within(residuals, std::numeric_limits<double>::infinity()));
  std::vector<double> lengths;
  for (size_t i = 0; i < residuals.size(); ++i) {
    const int of_point = observations[static_cast<size_t>(bundle.observations[i].point)];
    if (residuals[i].allFinite() && of_point > 1) {
      lengths.push_back(residuals[i].norm() / ShareOfLength(of_point));
    }
  }
  if (lengths.empty()) Reject("expected points in front of the cameras that see them, found none");
  return std::max(RobustSigma(std::move(lengths)), kPrecisionPx);
}

// Ways to turn, move and scale everything that observations do not tell, and priors leave open.
double OpenGauge(const AdjustOptions& options) {
  const double scale = options.distances.empty() ? 1 : 0;
  switch (options.positions.size()) {
    case 0:
      return 6 + scale;
    case 1:
      return 3 + scale;  // turns about the place
    case 2:
      return 1;  // a turn about the line between them
    default:
      return 0;
  }
}

// Unknowns of the images that count and their lenses. `rigs`: of how many rigs the images move; 0:
// every image for itself.
double CameraUnknowns(const Bundle& bundle, const std::vector<bool>& image_used, size_t rigs,
                      const AdjustOptions& options) {
  double images = 0, unknowns = 0;
  std::vector<bool> lens_used(bundle.lenses.size());
  for (size_t i = 0; i < image_used.size(); ++i) {
    if (!image_used[i]) continue;
    images += 1;
    lens_used[static_cast<size_t>(bundle.images[i].lens)] = true;
  }
  for (size_t i = 0; i < lens_used.size(); ++i) {
    if (!lens_used[i]) continue;
    unknowns += static_cast<double>(FreeParams(bundle.lenses[i], options.lens).size());
  }
  if (IsPerImage(options.lens)) unknowns += 2 * images;
  if (options.fix_poses) return unknowns;
  // A rig's own lengths leave six ways to move the world as a whole.
  return unknowns +
         (rigs > 0 ? 6 * static_cast<double>(rigs) - 6 : 6 * images - OpenGauge(options));
}

// `sigma_px`: what priors were weighted with.
void Describe(const std::vector<LensCamera>& known_lenses,
              const std::vector<Eigen::Vector2d>& residuals, size_t rigs,
              const AdjustOptions& options, double sigma_px, Adjusted& out) {
  // An observation that is alone in seeing its point is met whatever the cameras are.
  const std::vector<int> observations = ObservationsOfPoints(out.bundle, out.used);
  for (size_t i = 0; i < residuals.size(); ++i) {
    if (observations[static_cast<size_t>(out.bundle.observations[i].point)] < 2)
      out.used[i] = false;
  }
  double squared = 0;
  std::vector<bool> image_used(out.bundle.images.size()), point_used(out.bundle.points.size());
  for (size_t i = 0; i < residuals.size(); ++i) {
    out.without_pixel += !residuals[i].allFinite();
    if (!out.used[i]) continue;
    const BundleObservation& o = out.bundle.observations[i];
    squared += residuals[i].squaredNorm();
    ++out.observations;
    image_used[static_cast<size_t>(o.image)] = point_used[static_cast<size_t>(o.point)] = true;
  }
  out.rms_px = std::sqrt(squared / std::max(1, out.observations));
  const auto points = static_cast<double>(std::count(point_used.begin(), point_used.end(), true));
  double known = 0;
  squared += sigma_px * sigma_px * PriorSquares(known_lenses, out.bundle, options, &known);
  const double freedom = 2.0 * out.observations + known - 3 * points -
                         CameraUnknowns(out.bundle, image_used, rigs, options);
  // As many unknowns as numbers: all are explained, and nothing says how well.
  out.sigma_px =
      freedom > 0 ? std::sqrt(squared / freedom) : std::numeric_limits<double>::infinity();
}

void FixLens(const LensFrame& lens, LensFreedom freedom, double* theta, ceres::Problem& problem) {
  if (freedom == LensFreedom::kFixed) problem.SetParameterBlockConstant(theta);
  if (freedom == LensFreedom::kFixed || FreesPrincipalPoint(freedom)) return;
  const int centre = FocalCount(lens.model), params = static_cast<int>(lens.centre.size());
  std::vector<int> held;
  for (int k = centre; k < (freedom == LensFreedom::kFocal ? params : centre + 2); ++k) {
    held.push_back(k);
  }
  problem.SetManifold(theta, new ceres::SubsetManifold(params, held));
}

// `robust`: a few steps under a robust loss, to be followed by least squares.
ceres::Solver::Options SolverOptions(size_t images, bool robust) {
  ceres::Solver::Options options = SilentOptions();
  options.linear_solver_type = images <= kDenseImages ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  // Under the robust loss Ceres converges by a constant factor a step: it is left when the cameras
  // have settled, and least squares, which converges quadratically, does the rest.
  options.max_num_iterations = robust ? 8 : 100;
  options.function_tolerance = robust ? 1e-3 : 1e-11;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  return options;
}

struct Ended {
  int iterations = 0;
  bool converged = false;
};

Ended MinimiseByCeres(const Bundle& bundle, const std::vector<LensCamera>& known,
                      const AdjustOptions& options, const std::vector<bool>& used, double sigma_px,
                      double cauchy_px, Normalised& n) {
  ceres::Solver::Options solver = SolverOptions(bundle.images.size(), cauchy_px > 0);
  ceres::Problem problem;
  for (size_t i = 0; i < bundle.observations.size(); ++i) {
    if (!used[i]) continue;
    const BundleObservation& observation = bundle.observations[i];
    const auto image = static_cast<size_t>(observation.image);
    const auto lens = static_cast<size_t>(bundle.images[image].lens);
    std::vector<double*> blocks{n.theta[lens].data(), n.MotionOf(image),
                                n.place[static_cast<size_t>(observation.point)].data()};
    if (!n.shift.empty()) blocks.push_back(n.shift[image].data());
    problem.AddResidualBlock(n.Cost(bundle, observation).release(),
                             cauchy_px > 0 ? new ceres::CauchyLoss(cauchy_px) : nullptr, blocks);
  }
  AddPriors(bundle, known, options, sigma_px, n, problem);
  const auto add = [&](double* block, int group) {
    if (problem.HasParameterBlock(block)) {
      solver.linear_solver_ordering->AddElementToGroup(block, group);
    }
  };
  for (auto& place : n.place) add(place.data(), 0);
  for (auto& motion : n.members.empty() ? n.motion : n.rig_motion) {
    add(motion.data(), 1);
    if (options.fix_poses && problem.HasParameterBlock(motion.data())) {
      problem.SetParameterBlockConstant(motion.data());
    }
  }
  for (size_t i = 0; i < n.theta.size(); ++i) {
    if (!problem.HasParameterBlock(n.theta[i].data())) continue;
    // A group of its own: within a group Ceres orders unknowns by their addresses, and where one
    // array lies with respect to another differs from run to run.
    add(n.theta[i].data(), 2);
    FixLens(n.lenses[i], options.lens, n.theta[i].data(), problem);
  }
  for (auto& shift : n.shift) add(shift.data(), 3);
  const SilentProgress nobody;
  const Progress& progress = options.progress != nullptr ? *options.progress : nobody;
  double largest_px = 0;
  for (const LensCamera& lens : bundle.lenses) {
    largest_px = std::max<double>(largest_px, std::max(lens.width_px, lens.height_px));
  }
  SolverEnds ends(progress, static_cast<size_t>(problem.NumResiduals()), largest_px);
  solver.callbacks.push_back(&ends);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  progress.ThrowIfInterrupted();
  if (!summary.IsSolutionUsable()) Reject("the observations have no least-squares solution");
  n.FollowRig();
  return {static_cast<int>(summary.iterations.size()),
          summary.termination_type == ceres::CONVERGENCE ||
              summary.termination_type == ceres::USER_SUCCESS};
}

// One solve over the observations with used[i]; Cauchy's loss where a scale is given.
Ended Minimise(const Bundle& bundle, const std::vector<LensCamera>& known,
               const AdjustOptions& options, const std::vector<bool>& used, double sigma_px,
               double cauchy_px, Normalised& n) {
  if (!ServesPlain(bundle, options, n)) {
    return MinimiseByCeres(bundle, known, options, used, sigma_px, cauchy_px, n);
  }
  const plain::MinimiseResult found =
      MinimisePlain(bundle, known, options, used, sigma_px, cauchy_px, n);
  if (!std::isfinite(found.cost)) Reject("the observations have no least-squares solution");
  return {found.iterations, found.converged};
}

}  // namespace

const char* NameOf(LensFreedom freedom) {
  switch (freedom) {
    case LensFreedom::kFixed:
      return "fixed";
    case LensFreedom::kFocal:
      return "focal";
    case LensFreedom::kNoPrincipalPoint:
      return "no-principal-point";
    case LensFreedom::kAll:
      return "all";
    case LensFreedom::kTangential:
      return "tangential";
    case LensFreedom::kPrincipalPointPerImage:
      return "principal-point-per-image";
    case LensFreedom::kTangentialPerImage:
      return "tangential-per-image";
  }
  return "";
}

bool FreesPrincipalPoint(LensFreedom freedom) {
  return freedom != LensFreedom::kFixed && freedom != LensFreedom::kFocal &&
         freedom != LensFreedom::kNoPrincipalPoint;
}

bool IsPerImage(LensFreedom freedom) {
  return freedom == LensFreedom::kPrincipalPointPerImage ||
         freedom == LensFreedom::kTangentialPerImage;
}

bool IsTangential(LensFreedom freedom) {
  return freedom == LensFreedom::kTangential || freedom == LensFreedom::kTangentialPerImage;
}

bool MayGetTangential(const LensCamera& lens) {
  return lens.model == CameraModel::kSimpleRadial || lens.model == CameraModel::kRadial;
}

bool Contradicts(const Adjusted& held, const Adjusted& free) {
  constexpr double kMaxSigmaGrowth = 1.5;
  constexpr double kMinObservationShare = 0.9;
  // Errors of an observation's own size are no contradiction, however exact the photos are.
  constexpr double kHarmlessSigmaPx = 0.5;
  // Where all was needed for the unknowns nothing is known of the noise, and none is supposed.
  const double noise = std::isfinite(free.sigma_px) ? free.sigma_px : 0;
  const double most = std::max(kMaxSigmaGrowth * noise, kHarmlessSigmaPx);
  return !(held.sigma_px <= most) || held.observations < kMinObservationShare * free.observations;
}

std::vector<Eigen::Vector2d> Residuals(const Bundle& bundle) {
  return Normalised::Around(bundle).Residuals(bundle);
}

namespace {

void AddTangential(std::vector<LensCamera>& lenses) {
  for (LensCamera& lens : lenses) {
    if (MayGetTangential(lens)) lens = WithTwoFocalLengths(lens);
  }
}

int Differences(const std::vector<bool>& a, const std::vector<bool>& b) {
  int count = 0;
  for (size_t i = 0; i < a.size(); ++i) count += a[i] != b[i];
  return count;
}

// `known`: the lenses that the options' priors speak of.
Adjusted Solve(const Bundle& bundle, const std::vector<LensCamera>& known,
               const AdjustOptions& options, Normalised& n) {
  const Bundle start = n.LocalAt(bundle);
  Adjusted out;
  out.lens = options.lens;
  std::vector<Eigen::Vector2d> residuals = n.Residuals(bundle);
  double sigma = SigmaOf(bundle, residuals);
  const auto solve = [&](const std::vector<bool>& used, double cauchy_px) {
    const Ended ended = Minimise(bundle, known, options, used, sigma, cauchy_px, n);
    out.iterations += ended.iterations;
    residuals = n.Residuals(bundle);
    return ended.converged;
  };
  const double none = std::numeric_limits<double>::infinity();
  for (int pass = 0; options.outlier_sigmas > 0 && pass < kMaxRobustPasses; ++pass) {
    solve(Within(residuals, none), kCauchySigmas * std::max(sigma, kMinOutlierSigmaPx));
    const double next = SigmaOf(bundle, residuals);
    const bool settled = std::abs(next - sigma) <= kSameScale * sigma ||
                         std::max(next, sigma) <= kMinOutlierSigmaPx;  // the same loss again
    sigma = next;
    if (settled) break;
  }
  const auto counting = [&] {
    if (!(options.outlier_sigmas > 0)) return Within(residuals, none);
    std::vector<bool> used =
        Within(residuals, options.outlier_sigmas * std::max(sigma, kMinOutlierSigmaPx));
    if (!options.fix_poses) LeaveOutWithoutParallax(bundle, n, sigma, used);
    return used;
  };
  out.used = counting();
  for (int pass = 0; pass < kMaxOutlierPasses; ++pass) {
    out.converged = solve(out.used, 0);
    sigma = SigmaOf(bundle, residuals);
    std::vector<bool> used = counting();
    out.unsettled = Differences(used, out.used);
    if (out.unsettled == 0) break;
    if (pass + 1 < kMaxOutlierPasses) out.used = std::move(used);
  }
  out.bundle = n.LocalAt(bundle);
  if (options.positions.empty() && !options.fix_poses && n.members.empty()) {
    MoveToGaugeOf(start, out.bundle, !options.distances.empty());
  }
  n.ToWorld(out.bundle);
  Describe(known, residuals, n.rig_motion.size(), options, sigma, out);
  return out;
}

}  // namespace

Adjusted Adjust(const Bundle& bundle, const AdjustOptions& options) {
  CheckBundle(bundle);
  CheckPriors(bundle, options);
  Bundle start = bundle;
  std::vector<LensCamera> known =
      options.known_lenses != nullptr ? *options.known_lenses : bundle.lenses;
  if (IsTangential(options.lens)) {
    AddTangential(start.lenses);
    AddTangential(known);
  }
  if (known.size() != start.lenses.size()) Reject("expected known lenses as many as there are");
  for (size_t i = 0; i < known.size(); ++i) {
    if (known[i].model == start.lenses[i].model &&
        known[i].params.size() == start.lenses[i].params.size()) {
      continue;
    }
    Reject("expected known lenses of the models that there are");
  }
  Normalised n = Normalised::Around(start);
  if (IsPerImage(options.lens)) {
    if (options.fix_poses) Reject("principal points per image: expected poses that may move");
    n.shift.assign(bundle.images.size(), {});
  }
  return Solve(start, known, options, n);
}

Adjusted AdjustRig(const Bundle& bundle, std::span<const RigImage> images,
                   const std::vector<Pose>& rig_from_world, const AdjustOptions& options) {
  if (images.size() != bundle.images.size() || options.fix_poses || !options.positions.empty() ||
      !options.distances.empty() || IsPerImage(options.lens) || IsTangential(options.lens)) {
    Reject(
        "expected a rig with a position for every image, and no poses, priors, tangential "
        "distortion or principal points of images beside it");
  }
  Bundle rigid = bundle;
  for (size_t i = 0; i < images.size(); ++i) {
    const auto frame = static_cast<size_t>(images[i].frame);
    if (images[i].frame < 0 || frame >= rig_from_world.size()) Reject("expected a known frame");
    rigid.images[i].cam_from_world = images[i].cam_from_rig * rig_from_world[frame];
  }
  CheckBundle(rigid);
  Normalised n = Normalised::Around(rigid);
  n.rig_motion.assign(rig_from_world.size(), {});
  for (const RigImage& image : images) {
    const Pose& rig = rig_from_world[static_cast<size_t>(image.frame)];
    n.frames.push_back(image.frame);
    n.members.push_back({image.cam_from_rig.rotation.toRotationMatrix(),
                         rig.rotation.conjugate().toRotationMatrix(),
                         image.cam_from_rig.TargetOriginInSource() / n.unit});
  }
  return Solve(rigid, rigid.lenses, options, n);
}

}  // namespace dtr::calib
