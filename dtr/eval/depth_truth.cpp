#include "dtr/eval/depth_truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"

namespace dtr::eval {
namespace {

constexpr double kSameIntrinsicsPx = 1e-6;  // rounding of printed cameras, no more
constexpr float kOutlier = 0.02f, kGrossOutlier = 0.05f;

void RequirePositive(double factor, const char* what, bool zero_allowed) {
  if (!std::isfinite(factor) || factor < 0 || (factor == 0 && !zero_allowed)) {
    throw Error(fmt::format("depth truth: expected a positive {}, found {}", what, factor));
  }
}

std::optional<double> Share(long long hits, long long of) {
  if (of == 0) return std::nullopt;
  return static_cast<double>(hits) / static_cast<double>(of);
}

void RequireScale(int s, int width, int height) {
  if (s < 1 || s % 2 == 0 || width % s != 0 || height % s != 0) {
    throw Error(
        fmt::format("depth truth: expected a depth map 1/s of the image with s odd and "
                    "dividing {}x{}, found s = {}; score at full size instead",
                    width, height, s));
  }
}

}  // namespace

void DepthScorer::Add(const DepthImage& estimate, const DepthImage& truth, const Mask& scored,
                      double set_units_per_truth_unit, double px_per_inverse_depth,
                      const Grid<float>* inverse_depth_sigma) {
  if (estimate.width() != truth.width() || estimate.height() != truth.height()) {
    throw Error(
        fmt::format("depth truth: expected truth on the grid of the estimate ({}x{}), found "
                    "{}x{}",
                    estimate.width(), estimate.height(), truth.width(), truth.height()));
  }
  if (!scored.empty() && (scored.width() != truth.width() || scored.height() != truth.height())) {
    throw Error(fmt::format("depth truth: expected a mask of {}x{}, found {}x{}", truth.width(),
                            truth.height(), scored.width(), scored.height()));
  }
  if (inverse_depth_sigma != nullptr && (inverse_depth_sigma->width() != truth.width() ||
                                         inverse_depth_sigma->height() != truth.height())) {
    throw Error(fmt::format("depth truth: expected sigmas of {}x{}, found {}x{}", truth.width(),
                            truth.height(), inverse_depth_sigma->width(),
                            inverse_depth_sigma->height()));
  }
  if (estimate.kind() != DepthKind::kPlaneZ || truth.kind() != DepthKind::kPlaneZ) {
    throw Error("depth truth: expected plane z, found ray distances; convert with ToPlaneZ");
  }
  RequirePositive(set_units_per_truth_unit, "scale of the truth", false);
  RequirePositive(px_per_inverse_depth, "number of pixels per inverse depth", true);

  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      const bool kept = !DepthImage::IsHole(estimate(x, y));
      if (DepthImage::IsHole(truth(x, y))) {
        ++without_truth_;
        estimated_without_truth_ += kept;
        continue;
      }
      if (!scored.empty() && scored(x, y) == 0) continue;
      ++truth_pixels_;
      pixels_with_disparity_ += px_per_inverse_depth > 0;
      if (!kept) continue;
      const double true_z = set_units_per_truth_unit * truth(x, y), z = estimate(x, y);
      relative_errors_.push_back(static_cast<float>(std::abs(z - true_z) / true_z));
      if (px_per_inverse_depth > 0) {
        const double px = px_per_inverse_depth * std::abs(1 / z - 1 / true_z);
        within_half_px_ += px <= 0.5;
        within_1px_ += px <= 1;
        within_2px_ += px <= 2;
        const float sigma = inverse_depth_sigma != nullptr ? (*inverse_depth_sigma)(x, y) : 0.0f;
        if (sigma > 0) {
          sigma_.Add(px, px_per_inverse_depth * static_cast<double>(sigma),
                     relative_errors_.back() > kOutlier);
        }
      }
    }
  }
  if (px_per_inverse_depth > 0) {
    edges_.Add(estimate, truth, scored, set_units_per_truth_unit, px_per_inverse_depth);
  }
}

DepthScores DepthScorer::Scores() const {
  DepthScores scores;
  const auto kept = static_cast<long long>(relative_errors_.size());
  scores.truth_pixels = truth_pixels_;
  scores.kept_pixels = kept;
  const auto above = [&](float limit) {
    return std::count_if(relative_errors_.begin(), relative_errors_.end(),
                         [limit](float e) { return e > limit; });
  };
  scores.share_within_1pct = Share(kept - above(0.01f), truth_pixels_);
  scores.share_within_2pct = Share(kept - above(0.02f), truth_pixels_);
  scores.share_within_half_px = Share(within_half_px_, pixels_with_disparity_);
  scores.share_within_1px = Share(within_1px_, pixels_with_disparity_);
  scores.share_within_2px = Share(within_2px_, pixels_with_disparity_);
  scores.depth_completeness = Share(kept, truth_pixels_);
  scores.outlier_share = Share(above(kOutlier), kept);
  scores.outlier_share_5pct = Share(above(kGrossOutlier), kept);
  scores.share_estimated_without_truth = Share(estimated_without_truth_, without_truth_);
  scores.sigma = sigma_.Scores();
  scores.edges = edges_.Scores();
  if (kept > 0) {
    std::vector<float> errors = relative_errors_;
    scores.median_relative_error = UpperMedian(errors);
  }
  return scores;
}

DepthImage SubsampleTruth(const DepthImage& truth, int s) {
  if (s == 1) return truth;
  RequireScale(s, truth.width(), truth.height());
  DepthImage small(truth.width() / s, truth.height() / s, truth.kind());
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) small(x, y) = truth(s * x + s / 2, s * y + s / 2);
  }
  return small;
}

Mask SubsampleMask(const Mask& mask, int s) {
  if (s == 1 || mask.empty()) return mask;
  RequireScale(s, mask.width(), mask.height());
  Mask small(mask.width() / s, mask.height() / s);
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) small(x, y) = mask(s * x + s / 2, s * y + s / 2);
  }
  return small;
}

bool IsSameGrid(const PinholeCamera& truth, const PinholeCamera& view) {
  const auto near = [](double a, double b) { return std::abs(a - b) <= kSameIntrinsicsPx; };
  return truth.width_px() == view.width_px() && truth.height_px() == view.height_px() &&
         near(truth.fx_px(), view.fx_px()) && near(truth.fy_px(), view.fy_px()) &&
         near(truth.cx_px(), view.cx_px()) && near(truth.cy_px(), view.cy_px());
}

void RequireSameGrid(const PinholeCamera& truth, const PinholeCamera& view,
                     const std::string& name) {
  if (IsSameGrid(truth, view)) return;
  throw Error(fmt::format(
      "{}: expected truth on the set's grid ({}x{}, fx {:.6f}, cx {:.6f}, cy {:.6f}), found {}x{}, "
      "fx {:.6f}, cx {:.6f}, cy {:.6f}; cast the truth again on the set's cameras",
      name, view.width_px(), view.height_px(), view.fx_px(), view.cx_px(), view.cy_px(),
      truth.width_px(), truth.height_px(), truth.fx_px(), truth.cx_px(), truth.cy_px()));
}

}  // namespace dtr::eval
