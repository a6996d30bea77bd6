#include "calib/sfm/run/feature_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm {
namespace {

constexpr double kMib = 1024.0 * 1024.0;
// COLMAP's own start for the FOV model, which is singular at 0.
constexpr double kFovStart = 0.01;

struct LargestImage {
  double pixels = 0;  // of the largest photo
  double side_px = 0;
};

LargestImage LargestOf(const std::vector<SfmImageInput>& images) {
  LargestImage largest;
  for (const SfmImageInput& image : images) {
    const double pixels = static_cast<double>(image.width_px) * image.height_px;
    largest.pixels = std::max(largest.pixels, pixels);
    largest.side_px =
        std::max(largest.side_px, static_cast<double>(std::max(image.width_px, image.height_px)));
  }
  return largest;
}

// Pixels COLMAP works on when the long side is bounded.
double WorkingPixels(const std::vector<SfmImageInput>& images, double side_px) {
  double most = 0;
  for (const SfmImageInput& image : images) {
    const double scale = std::min(1.0, side_px / std::max(image.width_px, image.height_px));
    most = std::max(most, scale * scale * image.width_px * image.height_px);
  }
  return most;
}

double PeakMib(double working_pixels, double full_pixels, int threads) {
  return kBaseMib + (threads * kBytesPerPixelAndThread * working_pixels +
                     (threads + 1) * kQueueBytesPerPixel * full_pixels) /
                        kMib;
}

}  // namespace

std::vector<double> FirstGuess(calib::CameraModel model, const SfmImageInput& image,
                               double focal_px) {
  std::vector<double> params(static_cast<size_t>(calib::ParameterCount(model)), 0.0);
  const bool one_focal =
      model == calib::CameraModel::kSimplePinhole || model == calib::CameraModel::kSimpleRadial ||
      model == calib::CameraModel::kRadial || model == calib::CameraModel::kSimpleRadialFisheye ||
      model == calib::CameraModel::kRadialFisheye;
  size_t next = 0;
  params[next++] = focal_px;
  if (!one_focal) params[next++] = focal_px;
  params[next++] = 0.5 * image.width_px;
  params[next++] = 0.5 * image.height_px;
  if (model == calib::CameraModel::kFov) params[next] = kFovStart;
  return params;
}

ExtractionPlan PlanExtraction(const std::vector<SfmImageInput>& images, double memory_gb,
                              int requested_side_px) {
  const double limit_mib = kFill * memory_gb * kBytesPerGigabyte / kMib;
  const LargestImage largest = LargestOf(images);
  ExtractionPlan plan;
  double side_px = requested_side_px > 0 ? requested_side_px : kPreferredSidePx;
  side_px = std::min(side_px, largest.side_px);
  const auto peak = [&](double side, int count) {
    return PeakMib(WorkingPixels(images, side), largest.pixels, count);
  };
  while (side_px > kSmallestSidePx && peak(side_px, 1) > limit_mib) --side_px;
  if (peak(side_px, 1) > limit_mib) {
    constexpr double kShown = 100;  // of a gigabyte, rounded up: what is asked for must do
    throw UsageError(fmt::format(
        "`memory` {:g}: expected at least {:.2f} (GB) for features of photos of this size; give as "
        "much, or smaller photos",
        memory_gb,
        std::ceil(kShown * peak(side_px, 1) * kMib / kFill / kBytesPerGigabyte) / kShown));
  }
  plan.max_image_size_px = static_cast<int>(side_px);
  plan.threads = std::clamp(ThreadLimit::Current(), 1, static_cast<int>(images.size()));
  while (plan.threads > 1 && peak(side_px, plan.threads) > limit_mib) --plan.threads;
  plan.expected_peak_gib = peak(side_px, plan.threads) / 1024;
  return plan;
}

std::vector<CameraGroup> GroupCameras(const std::vector<SfmImageInput>& images,
                                      calib::CameraModel model, bool share) {
  using Key = std::tuple<std::string, int, int, size_t>;
  std::map<Key, size_t> index;
  std::vector<CameraGroup> groups;
  for (size_t i = 0; i < images.size(); ++i) {
    const SfmImageInput& image = images[i];
    const Key key{image.camera_group, image.width_px, image.height_px, share ? 0 : i};
    const auto [known, is_new] = index.emplace(key, groups.size());
    if (is_new) groups.emplace_back().model = model;
    groups[known->second].images.push_back(i);
  }
  for (CameraGroup& group : groups) {
    if (const auto& known = images[group.images.front()].known_lens) {
      group.model = known->model;
      group.params = known->params;
      continue;
    }
    std::vector<double> priors;
    for (const size_t i : group.images) {
      if (images[i].focal_prior_px) priors.push_back(*images[i].focal_prior_px);
    }
    if (!priors.empty()) {
      group.params = FirstGuess(model, images[group.images.front()], UpperMedian(priors));
    }
  }
  return groups;
}

std::string ParamsText(const std::vector<double>& params) {
  return fmt::format("{}", fmt::join(params, ","));
}

bool AllHavePriors(const std::vector<CameraGroup>& groups) {
  return std::none_of(groups.begin(), groups.end(),
                      [](const CameraGroup& group) { return group.params.empty(); });
}

Matching ResolveMatching(Matching matching, size_t images) {
  if (matching != Matching::kAuto) return matching;
  return images <= kExhaustiveLimit ? Matching::kExhaustive : Matching::kPreselected;
}

}  // namespace dtr::sfm
