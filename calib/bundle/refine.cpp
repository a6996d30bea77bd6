#include "calib/bundle/refine.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>

#include "calib/bundle/covariance.h"
#include "calib/bundle/held_out.h"
#include "calib/bundle/undetermined.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

constexpr double kLossSigmas =
    2;  // scale of the loss that unseen points and observations are evaluated by
constexpr int kMaxComparedPoints = 4000;  // that the candidates are compared on
// A principal point for every image also takes up what other faults of a lens model leave, and
// costs the lens's own principal point: what the images share, nothing but the prior says. So it
// must meet unseen points closer by this share; a stabiliser's pixels are worth several times that.
constexpr double kMinGainPerImage = 0.01;
constexpr std::array kRisingFreedom{LensFreedom::kNoPrincipalPoint, LensFreedom::kAll,
                                    LensFreedom::kTangential, LensFreedom::kPrincipalPointPerImage,
                                    LensFreedom::kTangentialPerImage};
// Of a lens for every image, which has its principal point by itself already.
constexpr std::array kRisingFreedomOfEach{LensFreedom::kFocal, LensFreedom::kNoPrincipalPoint,
                                          LensFreedom::kAll, LensFreedom::kTangential};

constexpr size_t kNoneConverged = ~size_t{0}, kNoScale = kNoneConverged - 1;
// Errors of features that lie near each other go together, so predicted ones are still small.
constexpr double kSurelySigmas = 5;

bool HasPriors(const RefineOptions& options) {
  return !options.positions.empty() || !options.distances.empty();
}

/// Options of a solve that frees `lens` (none: points alone move) and holds what is known.
AdjustOptions SolveOptions(const RefineOptions& options, const std::optional<LensFreedom>& lens) {
  AdjustOptions adjust = OptionsFor(lens);
  adjust.progress = options.progress;
  if (adjust.fix_poses) return adjust;
  adjust.aspect_sigma = kKnownAspectSigma;
  // Principal points of their own for all images make a solve nearly projective.
  if (options.separate_lenses) adjust.principal_point_share = kKnownPrincipalPointShare;
  adjust.positions = options.positions;
  adjust.distances = options.distances;
  return adjust;
}

/// Standard deviations (Mahalanobis length, the largest of all lenses) that a solve of these points
/// puts a principal point away from where it was given; 0 where it does not tell.
double PrincipalPointSigmas(const Bundle& bundle, const RefineOptions& refine) {
  const AdjustOptions options = SolveOptions(refine, LensFreedom::kAll);
  const Adjusted free = Adjust(bundle, options);
  const BundleCovariance covariance = CovarianceOf(free, options);
  if (!free.converged || !covariance.computed || !covariance.determined) return 0;
  double most = 0;
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    const auto& given = bundle.lenses[i].params;
    const auto& found = free.bundle.lenses[i].params;
    const int cx = FocalCount(bundle.lenses[i].model);
    const auto& params = covariance.free_params[i];
    const auto at = std::find(params.begin(), params.end(), cx) - params.begin();
    const long first = covariance.lens_at[i] + at;
    const auto k = static_cast<size_t>(cx);
    const Eigen::Vector2d moved(found[k] - given[k], found[k + 1] - given[k + 1]);
    const Eigen::Matrix2d variance = covariance.matrix.block<2, 2>(first, first);
    most = std::max(most, std::sqrt(moved.dot(variance.inverse() * moved)));
  }
  return most;
}

using Losses = std::vector<double>;  // per held-out point

/// Every second one, from the first or the second on.
Losses EverySecond(const Losses& losses, size_t first) {
  Losses some;
  for (size_t i = first; i < losses.size(); i += 2) some.push_back(losses[i]);
  return some;
}

/// Whether numbers that every image has by itself explain held-out points better beyond what is too
/// little to matter, and beyond chance both by the points that choose and by others that confirm.
bool IsConfirmed(const Losses& candidate, const Losses& chosen, std::uint64_t seed) {
  for (const size_t half : {0, 1}) {
    const Losses of_candidate = EverySecond(candidate, half), of_chosen = EverySecond(chosen, half);
    if (!(BootstrapOfDifference(of_candidate, of_chosen, seed).second < 0)) return false;
  }
  return std::sqrt(Mean(candidate)) < (1 - kMinGainPerImage) * std::sqrt(Mean(chosen));
}

/// Whether more freedom than the chosen candidate's is worth it: beyond chance, and of numbers that
/// every image has by itself as above.
bool IsWorthIt(const RefineCandidate& candidate, const RefineCandidate& chosen,
               const Losses& losses, const Losses& losses_of_chosen, const RefineOptions& options) {
  if (options.separate_lenses) return IsConfirmed(losses, losses_of_chosen, options.seed);
  if (!(candidate.high_px2 < 0)) return false;
  const bool newly_per_image = IsPerImage(*candidate.lens) && !IsPerImage(*chosen.lens);
  return !newly_per_image || candidate.held_out_px < (1 - kMinGainPerImage) * chosen.held_out_px;
}

/// What a solve of these points with a lens for every image leaves undetermined of the terms that
/// the candidate frees; empty: nothing.
std::string UndeterminedBy(const Bundle& bundle, const RefineCandidate& candidate,
                           const RefineOptions& refine) {
  const AdjustOptions options = SolveOptions(refine, candidate.lens);
  const Adjusted adjusted = Adjust(bundle, options);
  if (!adjusted.converged) return "all: the solve does not converge";
  const BundleCovariance covariance = CovarianceOf(adjusted, options);
  if (!covariance.computed) return "unknown: there are too many photos to tell";
  if (!covariance.determined) return covariance.weakest;
  return UndeterminedTerm(adjusted, covariance, options);
}

std::vector<RefineCandidate> CandidatesFor(const Bundle& bundle, bool separate_lenses) {
  std::vector<RefineCandidate> candidates{{"as given", {}, 0, 0, 0}};
  const std::span<const LensFreedom> rising =
      separate_lenses ? std::span<const LensFreedom>(kRisingFreedomOfEach)
                      : std::span<const LensFreedom>(kRisingFreedom);
  for (const LensFreedom freedom : rising) {
    if (IsTangential(freedom) &&
        std::none_of(bundle.lenses.begin(), bundle.lenses.end(), MayGetTangential)) {
      continue;
    }
    candidates.push_back({NameOf(freedom), freedom, 0, 0, 0});
  }
  return candidates;
}

/// The last candidate before `k` that frees no more than it: its solve is where that of `k` starts.
size_t LastWithin(const std::vector<RefineCandidate>& candidates, size_t k) {
  const LensFreedom freedom = *candidates[k].lens;
  for (size_t i = k; i-- > 1;) {
    const LensFreedom less = *candidates[i].lens;
    if ((!IsPerImage(less) || IsPerImage(freedom)) &&
        (!IsTangential(less) || IsTangential(freedom))) {
      return i;
    }
  }
  return 0;
}

/// A candidate's solve of a fold, from that of one with less freedom where that converged.
Adjusted Train(const Bundle& fold, AdjustOptions options, const Adjusted* less) {
  if (less == nullptr || !less->converged) return Adjust(fold, options);
  options.known_lenses = &fold.lenses;
  Bundle start = fold;
  start.lenses = less->bundle.lenses;
  start.images = less->bundle.images;
  start.points = less->bundle.points;
  return Adjust(start, options);
}

// Counts the solves of a refinement: of every candidate each fold, and that of all observations.
class SolveCount {
 public:
  SolveCount(Progress* progress, size_t solves) : progress_(progress) {
    if (progress_ != nullptr) progress_->Stage("bundle adjustment", static_cast<int>(solves));
  }
  // May be called from any thread.
  void Done() {
    if (progress_ != nullptr) progress_->Update(++done_);
  }

 private:
  Progress* progress_;
  std::atomic<int> done_ = 0;
};

/// What each candidate's cameras, adjusted to half of the points, make of the other half; per
/// candidate and point. The model as given has seen them all and cannot be compared with candidates
/// that have not: it is first by name only.
std::vector<Losses> TryOnUnseenPoints(const Bundle& bundle, const RefineOptions& options,
                                      double scale_px, std::vector<RefineCandidate>& candidates) {
  const std::vector<PointFold> folds = PointFolds(bundle, options.seed);
  SolveCount count(options.progress, candidates.size() * folds.size() + 1);
  std::vector<std::vector<double>> parts(candidates.size() * folds.size());
  std::vector<char> converged(parts.size());
  const int folds_at_once = static_cast<int>(folds.size());
  ParallelFor(0, folds_at_once, [&](int i) {
    const PointFold& fold = folds[static_cast<size_t>(i)];
    std::vector<Adjusted> trained(candidates.size());
    for (size_t k = 0; k < candidates.size(); ++k) {
      const Adjusted* const less = k > 0 ? &trained[LastWithin(candidates, k)] : nullptr;
      AdjustOptions solve = SolveOptions(options, candidates[k].lens);
      trained[k] = Train(fold.training, solve, less);
      const size_t at = k * folds.size() + static_cast<size_t>(i);
      converged[at] = trained[k].converged;
      parts[at] = LossesOfHeldOutPoints(trained[k].bundle, fold.asked, scale_px);
      count.Done();
    }
  });
  std::vector<Losses> losses(candidates.size());
  for (size_t i = 0; i < parts.size(); ++i) {
    const size_t k = i / folds.size();
    losses[k].insert(losses[k].end(), parts[i].begin(), parts[i].end());
    candidates[k].converged = (i % folds.size() == 0 || candidates[k].converged) && converged[i];
  }
  for (size_t k = 0; k < losses.size(); ++k) {
    candidates[k].held_out_px = std::sqrt(Mean(losses[k]));
  }
  return losses;
}

/// Whether cameras that were adjusted to half of the points predict the other half better than the
/// cameras as given, which have seen none.
bool BeatsGiven(const std::vector<Losses>& losses, size_t chosen, const RefineOptions& options,
                Refined& refined) {
  refined.given_px = refined.candidates[0].held_out_px;
  refined.adjusted_px = refined.candidates[chosen].held_out_px;
  refined.held_out_observations = static_cast<int>(losses[chosen].size());
  if (refined.given_px <= kPrecisionPx) return false;  // exact: what is left is rounding
  return BootstrapOfDifference(losses[chosen], losses[0], options.seed).second < 0;
}

/// Which lens parameters to free, by points that were not adjusted to; index of the candidate, or
/// kNoneConverged, or kNoScale where nothing says how far observations err. A candidate whose solve
/// did not converge is not taken.
size_t Choose(const Bundle& bundle, const ObservationSplit& split, const RefineOptions& options,
              bool given_are_independent, Refined& refined) {
  auto& candidates = refined.candidates;
  candidates = CandidatesFor(bundle, options.separate_lenses);
  double sigma_px = 0;
  LossesOfHeldOutPoints(bundle, split.training, 1, &sigma_px);
  if (!std::isfinite(sigma_px)) return kNoScale;
  const double scale_px = kLossSigmas * std::max(sigma_px, kPrecisionPx);
  const Bundle some = SomePoints(bundle, kMaxComparedPoints, options.seed);
  const auto losses = TryOnUnseenPoints(some, options, scale_px, candidates);
  size_t chosen = 0;
  for (size_t i = 1; i < candidates.size(); ++i) {
    RefineCandidate& candidate = candidates[i];
    if (chosen > 0) {
      std::tie(candidate.low_px2, candidate.high_px2) =
          BootstrapOfDifference(losses[i], losses[chosen], options.seed);
    }
    bool better =
        chosen == 0 || IsWorthIt(candidate, candidates[chosen], losses[i], losses[chosen], options);
    if (better && options.separate_lenses && chosen > 0) {
      candidate.undetermined = UndeterminedBy(some, candidate, options);
      better = candidate.undetermined.empty();
    }
    if (!better && !options.separate_lenses && candidate.lens == LensFreedom::kAll &&
        !(candidate.low_px2 > 0)) {
      // A principal point off its place is nearly a turn of all cameras, which unseen points hardly
      // tell; what all observations together say of it is known by its covariance.
      candidate.principal_point_sigmas = PrincipalPointSigmas(some, options);
      better = candidate.principal_point_sigmas > kSurelySigmas;
    }
    if (candidate.converged && better) chosen = i;
  }
  if (!candidates[0].converged || chosen == 0) return kNoneConverged;
  const bool by_points = given_are_independent && !HasPriors(options);
  if (by_points && !BeatsGiven(losses, chosen, options, refined)) return 0;
  refined.adjusted = Adjust(bundle, SolveOptions(options, candidates[chosen].lens));
  if (by_points) return refined.adjusted.converged ? chosen : kNoneConverged;
  // Now like with like: adjusted to all observations, as the given model was.
  const auto given = LossesOfHeldOutObservations(bundle, split, scale_px);
  const auto adjusted = LossesOfHeldOutObservations(refined.adjusted.bundle, split, scale_px);
  refined.given_px = std::sqrt(Mean(given));
  refined.adjusted_px = std::sqrt(Mean(adjusted));
  refined.held_out_observations = static_cast<int>(split.held_out.size());
  if (!refined.adjusted.converged) return kNoneConverged;
  if (HasPriors(options)) return chosen;
  if (refined.given_px <= kPrecisionPx) return 0;  // exact: what is left is rounding
  // Beyond chance: a model that saw fewer observations, or none, need not be wrong for it. Of more
  // than a lens's usual freedom points that were not adjusted to have shown already that it is
  // worth it; observations that both models were adjusted to must not contradict.
  const auto [low, high] = BootstrapOfDifference(adjusted, given, options.seed);
  const bool is_shown = chosen > 1;
  return high < 0 || (is_shown && low <= 0) ? chosen : 0;
}

bool Refinable(const SfmModel& model, std::string* reason) {
  for (const auto& [id, camera] : model.cameras) {
    if (IsAdjustable(camera.model)) continue;
    *reason = "the camera model " + NameOf(camera.model) + " cannot be adjusted";
    return false;
  }
  if (model.images.size() < 3) {
    *reason = "fewer than 3 images: nothing can be held out";
    return false;
  }
  return true;
}

void AskDetermined(const SfmModel& model, const RefineOptions& options) {
  if (!options.determined.empty()) RequireDetermined(model, options, options.determined);
}

void Finish(const SfmModel& model, const RefineOptions& options, Refined& refined) {
  refined.model =
      ModelOf(refined.adjusted.bundle, model, options.separate_lenses, &refined.points_dropped);
  if (options.covariance) {
    refined.covariance = CovarianceReportOf(
        refined.adjusted, CovarianceOf(refined.adjusted, SolveOptions(options, refined.lens)));
  }
  refined.solve = refined.adjusted;
  refined.adjusted.bundle = {};
  refined.changed = true;
}

}  // namespace

SfmModel WithLenses(SfmModel model, const std::map<std::uint32_t, LensCamera>& lenses) {
  for (auto& [id, camera] : model.cameras) {
    const auto known = lenses.find(id);
    if (known == lenses.end()) {
      throw Error(fmt::format(
          "bundle adjustment: expected known intrinsics for camera {}, found none", id));
    }
    if (known->second.width_px != camera.width_px || known->second.height_px != camera.height_px) {
      throw Error(fmt::format(
          "bundle adjustment: expected intrinsics for images of {}x{}, found some "
          "for {}x{}; scale it to the photos",
          camera.width_px, camera.height_px, known->second.width_px, known->second.height_px));
    }
    camera = known->second;
  }
  return model;
}

namespace {

Refined RefineModel(const SfmModel& model, const RefineOptions& options,
                    bool given_are_independent) {
  Refined refined;
  refined.model = model;
  if (options.known_lenses) {
    const SfmModel known = WithLenses(model, *options.known_lenses);
    AskDetermined(known, options);
    refined.lens = LensFreedom::kFixed;
    refined.adjusted = Adjust(BundleOf(known), SolveOptions(options, refined.lens));
    if (!refined.adjusted.converged) {
      throw Error(
          fmt::format("bundle adjustment: expected to converge with the intrinsics that were "
                      "given, found none of it "
                      "after {} iterations; are they those of these photos?",
                      refined.adjusted.iterations));
    }
    Finish(known, options, refined);
    return refined;
  }
  AskDetermined(model, options);
  if (!Refinable(model, &refined.reason)) return refined;
  const Bundle bundle = BundleOf(model, options.separate_lenses);
  const ObservationSplit split =
      SplitObservations(SomePoints(bundle, kMaxComparedPoints, options.seed), options.seed);
  const auto enough = split.held_out.size();
  if (enough < kMinHeldOut) {
    refined.held_out_observations = static_cast<int>(enough);
    refined.reason = fmt::format("expected {} points that {} or more images see, found {}",
                                 kMinHeldOut, kMinTrack, enough);
    return refined;
  }
  const size_t chosen = Choose(bundle, split, options, given_are_independent, refined);
  if (chosen == kNoneConverged || chosen == kNoScale || chosen == 0) {
    refined.reason = chosen == 0          ? "held-out observations are predicted no better"
                     : chosen == kNoScale ? "the observations are no more than the unknowns"
                                          : "the solve did not converge";
    refined.adjusted = {};
    return refined;
  }
  refined.lens = refined.candidates[chosen].lens;
  Finish(model, options, refined);
  return refined;
}

}  // namespace

Refined Refine(const SfmModel& model, const RefineOptions& options) {
  return RefineModel(model, options, false);
}

Refined RefineIndependent(const SfmModel& model, const RefineOptions& options) {
  return RefineModel(model, options, true);
}

std::vector<Degeneracy> DegeneraciesOf(const SfmModel& model, const RefineOptions& options) {
  for (const auto& [id, camera] : model.cameras) {
    if (!IsAdjustable(camera.model)) return {};
  }
  const Bundle bundle =
      SomePoints(BundleOf(model, options.separate_lenses), kMaxComparedPoints, options.seed);
  const AdjustOptions adjust = SolveOptions(
      options, options.known_lenses ? LensFreedom::kFixed : LensFreedom::kNoPrincipalPoint);
  const Adjusted adjusted = Adjust(bundle, adjust);
  return FindDegeneracies(adjusted, CovarianceOf(adjusted, adjust), kMaxFocalShare);
}

std::string WhyUndetermined(const SfmModel& model, const RefineOptions& options) {
  for (const Degeneracy& d : DegeneraciesOf(model, options)) {
    if (!d.harmful || d.name == "duplicate_images" || d.name == "too_few_views") continue;
    return fmt::format("{}: {}", d.name, d.detail);
  }
  return "";
}

void RequireDetermined(const SfmModel& model, const RefineOptions& options,
                       const std::string& what) {
  const std::string why = WhyUndetermined(model, options);
  if (why.empty()) return;
  throw Error(
      fmt::format("{}: {}; {}", what, why,
                  !options.advice.empty()
                      ? options.advice
                      : "take photos from more positions, around what they show, or give the "
                        "camera (`lens`); docs/VALIDATION.md names what each degeneracy lacks"));
}

double HeldOutErrorPx(const SfmModel& model, std::uint64_t seed, int* count) {
  const Bundle bundle = BundleOf(model);
  const ObservationSplit split =
      SplitObservations(SomePoints(bundle, kMaxComparedPoints, seed), seed);
  // Cauchy's loss is monotone in the length: its inverse gives the lengths back.
  constexpr double kScalePx = 1;
  std::vector<double> lengths_px;
  for (const double loss : LossesOfHeldOutObservations(bundle, split, kScalePx)) {
    lengths_px.push_back(kScalePx * std::sqrt(std::expm1(loss / (kScalePx * kScalePx))));
  }
  *count = static_cast<int>(lengths_px.size());
  if (lengths_px.empty()) return std::numeric_limits<double>::quiet_NaN();
  return UpperMedian(lengths_px);
}

std::string RemarkOn(const Refined& refined) {
  if (!refined.changed || refined.adjusted.unsettled == 0) return "";
  return fmt::format(
      "bundle adjustment: which observations are outliers did not settle: {} of {} would change "
      "with another solve",
      refined.adjusted.unsettled, refined.adjusted.used.size());
}

}  // namespace dtr::calib
