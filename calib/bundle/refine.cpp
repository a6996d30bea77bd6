#include "calib/bundle/refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::calib {
namespace {

constexpr int kFewestHeldOut = 100;  // below, the comparison would be a matter of luck
constexpr int kMinTrack = 4;         // one sight to hold out, three to place the point
constexpr double kLossSigmas = 2;    // scale of the loss that held-out sights are judged by
constexpr int kMostPoints = 4000;    // that the candidates are compared on
constexpr int kResamples = 1000;
constexpr double kConfidence = 0.95;
// A principal point for every image also takes up what other faults of a lens model leave, and
// costs the lens's own principal point: what the images share, nothing but the prior says. So it
// must predict sights closer by this share; a stabiliser's pixels are worth several times that.
constexpr double kLeastGainPerImage = 0.05;
constexpr std::array kRisingFreedom{LensFreedom::kNoPrincipalPoint, LensFreedom::kAll,
                                    LensFreedom::kTangential, LensFreedom::kPrincipalPointPerImage};
constexpr std::uint64_t kPick = 0x401d, kBoot = 0xb007, kSome = 0x50e;  // of random sequences

struct Split {
  Bundle training;
  std::vector<BundleObservation> held_out;  // one of each point at most
};

Split SplitSights(const Bundle& bundle, std::uint64_t seed) {
  Split split{bundle, {}};
  split.training.observations.clear();
  const auto& all = bundle.observations;
  for (size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && all[end].point == all[begin].point) ++end;
    size_t picked = end;  // none
    if (end - begin >= kMinTrack) {
      Random random(HashOf(seed, kPick, bundle.point_ids[static_cast<size_t>(all[begin].point)]));
      picked = begin + static_cast<size_t>(random.Index(static_cast<int>(end - begin)));
    }
    for (size_t i = begin; i < end; ++i) {
      (i == picked ? split.held_out : split.training.observations).push_back(all[i]);
    }
  }
  return split;
}

// About `most` of the points, drawn by their ids: cameras are known from thousands of them well
// enough to be compared.
Bundle SomePoints(const Bundle& bundle, int most, std::uint64_t seed) {
  const double share = static_cast<double>(most) / static_cast<double>(bundle.points.size());
  if (share >= 1) return bundle;
  Bundle some = bundle;
  std::erase_if(some.observations, [&](const BundleObservation& o) {
    const auto id = bundle.point_ids[static_cast<size_t>(o.point)];
    return UniformFromHash(HashOf(seed, kSome, id)) >= share;
  });
  return some;
}

// Squared losses of the held-out sights; one whose point has no pixel counts like one far off.
std::vector<double> Losses(const Bundle& trained, const std::vector<BundleObservation>& held_out,
                           double scale_px) {
  Bundle asked = trained;
  asked.observations = held_out;
  std::vector<double> losses;
  const double c2 = scale_px * scale_px;
  for (const Eigen::Vector2d& r : Residuals(asked)) {
    const double squared = r.allFinite() ? r.squaredNorm() : 1e4 * c2;
    losses.push_back(c2 * std::log1p(squared / c2));
  }
  return losses;
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

// Percentile interval of mean(a - b) over resampled points.
std::pair<double, double> Bootstrap(const std::vector<double>& a, const std::vector<double>& b,
                                    std::uint64_t seed) {
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

AdjustOptions OptionsFor(const std::optional<LensFreedom>& lens) {
  AdjustOptions options;
  options.fix_poses = !lens;
  options.lens = lens.value_or(LensFreedom::kFixed);
  return options;
}

// Cameras that have seen all sights, held-out ones too; points that have not.
std::vector<double> LossesOfCameras(const Bundle& cameras, const Split& split, double scale_px) {
  Bundle asked = split.training;
  asked.lenses = cameras.lenses;
  asked.images = cameras.images;
  asked.points = cameras.points;
  return Losses(Adjust(asked, OptionsFor({})).bundle, split.held_out, scale_px);
}

constexpr size_t kNoneConverged = ~size_t{0};

// Whether more freedom than the chosen candidate's is worth it: beyond chance, and for a number
// that every image has by itself beyond what is too little to matter.
bool IsWorthIt(const RefineCandidate& candidate, const RefineCandidate& chosen) {
  if (!(candidate.high_px2 < 0)) return false;
  return candidate.lens != LensFreedom::kPrincipalPointPerImage ||
         candidate.held_out_px < (1 - kLeastGainPerImage) * chosen.held_out_px;
}

// Which lens parameters to free, by held-out sights; index of the candidate, or kNoneConverged. A
// candidate whose solve did not converge is not taken. The model as given has
// seen the held-out sights and cannot be compared with candidates that have not: it is first by
// name only, and its figures are of cameras that saw all.
size_t Choose(const Bundle& bundle, const Split& split, const RefineOptions& options,
              Refined& refined) {
  refined.held_out_sights = static_cast<int>(split.held_out.size());
  refined.candidates = {{"as given", {}, 0, 0, 0}};
  for (const LensFreedom freedom : kRisingFreedom) {
    // A lens for every image has its principal point already.
    if (freedom == LensFreedom::kPrincipalPointPerImage && options.separate_lenses) continue;
    if (freedom == LensFreedom::kTangential &&
        std::none_of(bundle.lenses.begin(), bundle.lenses.end(), MayGetTangential)) {
      continue;
    }
    refined.candidates.push_back({NameOf(freedom), freedom, 0, 0, 0});
  }
  auto& candidates = refined.candidates;
  std::vector<Adjusted> trained(candidates.size());
  ParallelFor(0, static_cast<int>(candidates.size()), options.threads, [&](int i) {
    const auto at = static_cast<size_t>(i);
    trained[at] = Adjust(split.training, OptionsFor(candidates[at].lens));
  });
  std::vector<std::vector<double>> losses;
  for (size_t i = 0; i < candidates.size(); ++i) {
    losses.push_back(
        Losses(trained[i].bundle, split.held_out, kLossSigmas * trained.front().sigma_px));
    candidates[i].held_out_px = std::sqrt(Mean(losses[i]));
  }
  for (size_t i = 0; i < candidates.size(); ++i) candidates[i].converged = trained[i].converged;
  size_t chosen = 0;
  for (size_t i = 1; i < candidates.size(); ++i) {
    RefineCandidate& candidate = candidates[i];
    if (chosen > 0) {
      std::tie(candidate.low_px2, candidate.high_px2) =
          Bootstrap(losses[i], losses[chosen], options.seed);
    }
    const bool better = chosen == 0 || IsWorthIt(candidate, candidates[chosen]);
    if (candidate.converged && better) chosen = i;
  }
  if (!trained[0].converged || chosen == 0) return kNoneConverged;
  // Now like with like: adjusted to all sights, as the given model was.
  refined.adjusted = Adjust(bundle, OptionsFor(candidates[chosen].lens));
  const auto adjusted =
      LossesOfCameras(refined.adjusted.bundle, split, kLossSigmas * trained.front().sigma_px);
  RefineCandidate last{
      "adjusted to all",          candidates[chosen].lens, std::sqrt(Mean(adjusted)), 0, 0,
      refined.adjusted.converged,
  };
  std::tie(last.low_px2, last.high_px2) = Bootstrap(adjusted, losses[0], options.seed);
  candidates.push_back(last);
  if (!last.converged) return kNoneConverged;
  // Beyond chance: a model that saw fewer sights, or none, need not be wrong for it.
  return last.high_px2 < 0 ? chosen : 0;
}

bool Refinable(const SfmModel& model, std::string* reason) {
  for (const auto& [id, camera] : model.cameras) {
    if (camera.model != LensModel::kFov) continue;
    *reason = "the lens model FOV cannot be adjusted";
    return false;
  }
  if (model.images.size() < 3) {
    *reason = "fewer than 3 images: nothing can be held out";
    return false;
  }
  return true;
}

void Finish(const SfmModel& model, const RefineOptions& options, Refined& refined) {
  refined.model =
      ModelOf(refined.adjusted.bundle, model, options.separate_lenses, &refined.points_dropped);
  refined.adjusted.bundle = {};
  refined.changed = true;
}

SfmModel WithLenses(SfmModel model, const std::map<std::uint32_t, LensCamera>& lenses) {
  for (auto& [id, camera] : model.cameras) {
    const auto known = lenses.find(id);
    if (known == lenses.end()) {
      throw Error(
          fmt::format("bundle adjustment: expected a known lens for camera {}, found none", id));
    }
    if (known->second.width_px != camera.width_px || known->second.height_px != camera.height_px) {
      throw Error(fmt::format(
          "bundle adjustment: expected a lens for images of {}x{}, found one "
          "for {}x{}; scale it to the photos",
          camera.width_px, camera.height_px, known->second.width_px, known->second.height_px));
    }
    camera = known->second;
  }
  return model;
}

}  // namespace

Refined Refine(const SfmModel& model, const RefineOptions& options) {
  Refined refined;
  refined.model = model;
  if (options.known_lenses) {
    const SfmModel known = WithLenses(model, *options.known_lenses);
    refined.lens = LensFreedom::kFixed;
    refined.adjusted = Adjust(BundleOf(known), OptionsFor(refined.lens));
    if (!refined.adjusted.converged) {
      throw Error(fmt::format(
          "bundle adjustment: expected to converge with the lens that was given, found none of it "
          "after {} iterations; is it the lens of these photos?",
          refined.adjusted.iterations));
    }
    Finish(known, options, refined);
    return refined;
  }
  if (!Refinable(model, &refined.reason)) return refined;
  const Bundle bundle = BundleOf(model, options.separate_lenses);
  const Split split = SplitSights(SomePoints(bundle, kMostPoints, options.seed), options.seed);
  const auto enough = split.held_out.size();
  if (enough < kFewestHeldOut) {
    refined.held_out_sights = static_cast<int>(enough);
    refined.reason = fmt::format("expected {} points that {} or more images see, found {}",
                                 kFewestHeldOut, kMinTrack, enough);
    return refined;
  }
  const size_t chosen = Choose(bundle, split, options, refined);
  if (chosen == kNoneConverged || chosen == 0) {
    refined.reason =
        chosen == 0 ? "held-out sights are predicted no better" : "the solve did not converge";
    refined.adjusted = {};
    return refined;
  }
  refined.lens = refined.candidates[chosen].lens;
  Finish(model, options, refined);
  return refined;
}

std::vector<Degeneracy> DegeneraciesOf(const SfmModel& model, const RefineOptions& options) {
  for (const auto& [id, camera] : model.cameras) {
    if (camera.model == LensModel::kFov) return {};
  }
  const Bundle bundle =
      SomePoints(BundleOf(model, options.separate_lenses), kMostPoints, options.seed);
  const AdjustOptions adjust =
      OptionsFor(options.known_lenses ? LensFreedom::kFixed : LensFreedom::kNoPrincipalPoint);
  const Adjusted adjusted = Adjust(bundle, adjust);
  return FindDegeneracies(adjusted, CovarianceOf(adjusted, adjust), BundleLimits{}.max_focal_share);
}

void RequireDetermined(const SfmModel& model, const RefineOptions& options,
                       const std::string& what) {
  for (const Degeneracy& d : DegeneraciesOf(model, options)) {
    if (!d.harmful || d.name == "duplicate_images" || d.name == "too_few_views") continue;
    throw Error(
        fmt::format("{}: {}: {}; expected views that determine the cameras; "
                    "docs/CALIBRATION.md says what to do",
                    what, d.name, d.detail));
  }
}

std::string ToJson(const Refined& refined) {
  nlohmann::ordered_json json;
  json["refined"] = refined.changed;
  if (!refined.reason.empty()) json["reason"] = refined.reason;
  if (refined.lens) json["lens"] = NameOf(*refined.lens);
  json["held_out_sights"] = refined.held_out_sights;
  json["candidates"] = nlohmann::ordered_json::array();
  for (const RefineCandidate& c : refined.candidates) {
    json["candidates"].push_back({{"name", c.name},
                                  {"held_out_px", c.held_out_px},
                                  {"low_px2", c.low_px2},
                                  {"high_px2", c.high_px2},
                                  {"converged", c.converged}});
  }
  if (refined.changed) {
    json["sigma_px"] = refined.adjusted.sigma_px;
    json["rms_px"] = refined.adjusted.rms_px;
    json["iterations"] = refined.adjusted.iterations;
    json["converged"] = refined.adjusted.converged;
    json["points_dropped"] = refined.points_dropped;
  }
  return json.dump();
}

}  // namespace dtr::calib
