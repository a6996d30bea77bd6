#include "calib/bundle/camera_sharing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "calib/bundle/held_out.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

using Groups = std::vector<std::vector<std::uint32_t>>;

constexpr int kMaxPoints = 4000;         // that take part in the comparison
constexpr double kSharedLossSigmas = 2;  // scale of the loss, as for the choice of free parameters
// A significant gain that is smaller than this changes no rendered pixel: the simpler model is
// kept.
constexpr double kMinGain = 0.01;
constexpr double kMinSigmaPx = 1e-7;  // exact observations differ by rounding alone

std::map<std::uint32_t, int> ImagesPerCamera(const SfmModel& model) {
  std::map<std::uint32_t, int> images;
  for (const SfmImage& image : model.images) ++images[image.camera_id];
  return images;
}

// The model with one camera for each group: the mean of its cameras, weighted by their images.
SfmModel Merged(const SfmModel& model, const Groups& groups) {
  const auto images = ImagesPerCamera(model);
  SfmModel merged = model;
  std::map<std::uint32_t, std::uint32_t> new_id;
  for (const auto& group : groups) {
    LensCamera& camera = merged.cameras.at(group.front());
    std::fill(camera.params.begin(), camera.params.end(), 0.0);
    double weights = 0;
    for (const std::uint32_t id : group) weights += images.at(id);
    for (const std::uint32_t id : group) {
      new_id[id] = group.front();
      const std::vector<double>& params = model.cameras.at(id).params;
      for (size_t i = 0; i < params.size(); ++i) {
        camera.params[i] += images.at(id) / weights * params[i];
      }
      if (id != group.front()) merged.cameras.erase(id);
    }
  }
  for (SfmImage& image : merged.images) {
    const auto found = new_id.find(image.camera_id);
    if (found != new_id.end()) image.camera_id = found->second;
  }
  return merged;
}

struct Trial {
  std::vector<double> losses;  // per held-out point
  bool converged = false;
};

// What cameras, adjusted to half of the points, make of the other half.
class Comparison {
 public:
  Comparison(const SfmModel& model, const SharingOptions& options)
      : model_(model), options_(options) {
    adjust_ = OptionsFor(LensFreedom::kNoPrincipalPoint);
    adjust_.progress = options.progress;
    const Bundle some = SomePoints(BundleOf(model), kMaxPoints, options.seed);
    double sigma_px = 0;
    points_ = LossesOfHeldOutPoints(some, some, 1, &sigma_px).size();
    scale_px_ = kSharedLossSigmas * std::max(sigma_px, kMinSigmaPx);
  }

  std::string WhyNot() const {
    if (points_ < kMinHeldOut) {
      return fmt::format("{} points are in {} photos or more; the test needs {}", points_,
                         kMinTrack, kMinHeldOut);
    }
    if (!std::isfinite(scale_px_)) return "there are as many unknowns as observations";
    return "";
  }

  Trial Try(const Groups& groups) const {
    const Bundle some = SomePoints(BundleOf(Merged(model_, groups)), kMaxPoints, options_.seed);
    const std::vector<PointFold> folds = PointFolds(some, options_.seed);
    std::vector<Trial> halves(folds.size());
    ParallelFor(0, static_cast<int>(folds.size()), [&](int i) {
      const auto at = static_cast<size_t>(i);
      const Adjusted trained = Adjust(folds[at].training, adjust_);
      halves[at] = {LossesOfHeldOutPoints(trained.bundle, folds[at].asked, scale_px_),
                    trained.converged};
    });
    Trial trial{{}, true};
    for (const Trial& half : halves) {
      trial.losses.insert(trial.losses.end(), half.losses.begin(), half.losses.end());
      trial.converged = trial.converged && half.converged;
    }
    return trial;
  }

  /// Whether `separate`, with more parameters than `shared`, is worth them.
  bool IsWorthIt(const Trial& separate, const Trial& shared) const {
    if (!shared.converged) return true;
    if (!separate.converged) return false;
    const auto [low, high] = BootstrapOfDifference(separate.losses, shared.losses, options_.seed);
    return high < 0 &&
           std::sqrt(Mean(separate.losses)) < (1 - kMinGain) * std::sqrt(Mean(shared.losses));
  }

  /// The merged model at its optimum for these points, so that later steps start from cameras that
  /// fit; all points are placed by them.
  SfmModel ModelFor(const Groups& groups) const {
    const SfmModel merged = Merged(model_, groups);
    Bundle all = BundleOf(merged);
    const Adjusted cameras = Adjust(SomePoints(all, kMaxPoints, options_.seed), adjust_);
    all.lenses = cameras.bundle.lenses;
    all.images = cameras.bundle.images;
    AdjustOptions points = OptionsFor({});
    points.progress = options_.progress;
    return ModelOf(Adjust(all, points).bundle, merged, false, nullptr);
  }

 private:
  const SfmModel& model_;
  const SharingOptions& options_;
  AdjustOptions adjust_;
  double scale_px_ = 0;
  size_t points_ = 0;
};

double FocalOf(const SfmModel& model, const std::vector<std::uint32_t>& group) {
  double sum = 0;
  for (const std::uint32_t id : group) sum += model.cameras.at(id).params.front();
  return sum / static_cast<double>(group.size());
}

// Merges neighbours in focal length, nearest first, as long as held-out observations allow it.
Groups PairwiseMerged(const SfmModel& model, Groups groups, const Comparison& comparison,
                      Trial best) {
  std::sort(groups.begin(), groups.end(),
            [&](const auto& a, const auto& b) { return FocalOf(model, a) < FocalOf(model, b); });
  std::vector<std::pair<std::uint32_t, std::uint32_t>> rejected;  // first cameras of two groups
  while (groups.size() > 2) {
    size_t nearest = groups.size();
    double least = 0;
    for (size_t i = 0; i + 1 < groups.size(); ++i) {
      const std::pair pair{groups[i].front(), groups[i + 1].front()};
      if (std::find(rejected.begin(), rejected.end(), pair) != rejected.end()) continue;
      const double distance = FocalOf(model, groups[i + 1]) / FocalOf(model, groups[i]);
      if (nearest < groups.size() && distance >= least) continue;
      nearest = i;
      least = distance;
    }
    if (nearest == groups.size()) break;
    Groups fewer = groups;
    auto& into = fewer[nearest];
    into.insert(into.end(), fewer[nearest + 1].begin(), fewer[nearest + 1].end());
    std::sort(into.begin(), into.end());
    fewer.erase(fewer.begin() + static_cast<long>(nearest) + 1);
    Trial trial = comparison.Try(fewer);
    if (comparison.IsWorthIt(best, trial)) {
      rejected.emplace_back(groups[nearest].front(), groups[nearest + 1].front());
      continue;
    }
    groups = std::move(fewer);
    best = std::move(trial);
  }
  std::sort(groups.begin(), groups.end());
  return groups;
}

}  // namespace

SharedCameras ShareCameras(const SfmModel& model, std::vector<std::uint32_t> cameras,
                           const SharingOptions& options) {
  std::sort(cameras.begin(), cameras.end());
  SharedCameras out;
  out.model = model;
  for (const std::uint32_t id : cameras) out.groups.push_back({id});
  if (cameras.size() < 2) {
    out.not_tested = "one folder alone has photos with a camera";
    return out;
  }
  for (const auto& [id, camera] : model.cameras) {
    if (IsAdjustable(camera.model)) continue;
    out.not_tested = "the camera model " + NameOf(camera.model) + " cannot be adjusted";
    return out;
  }
  const Comparison comparison(model, options);
  out.not_tested = comparison.WhyNot();
  if (!out.not_tested.empty()) return out;
  const Trial separate = comparison.Try(out.groups), shared = comparison.Try({cameras});
  out.separate_px = std::sqrt(Mean(separate.losses));
  out.shared_px = std::sqrt(Mean(shared.losses));
  out.shared_converged = shared.converged;
  std::tie(out.low_px2, out.high_px2) =
      BootstrapOfDifference(separate.losses, shared.losses, options.seed);
  if (!separate.converged && !shared.converged) {
    out.not_tested = "bundle adjustment of part of the points did not converge";
    return out;
  }
  if (!comparison.IsWorthIt(separate, shared)) {
    out.groups = {cameras};
  } else if (cameras.size() > 2 && cameras.size() <= kMaxPairwise) {
    out.groups = PairwiseMerged(model, out.groups, comparison, separate);
  }
  if (out.groups.size() < cameras.size()) out.model = comparison.ModelFor(out.groups);
  return out;
}

}  // namespace dtr::calib
