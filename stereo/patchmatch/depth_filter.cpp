#include "stereo/patchmatch/depth_filter.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "stereo/patchmatch/hypotheses.h"
#include "stereo/patchmatch/planar_prior.h"
#include "stereo/patchmatch/speckles.h"
#include "stereo/prior_use.h"

namespace dtr::stereo::patchmatch {
namespace {

/// What a pixel must meet to be kept.
struct Limits {
  float cost;      ///< largest 1 - NCC, weighted mean of the views that count
  float sigma_px;  ///< largest standard deviation, pixels of disparity
  int agreeing;    ///< least number of views that see the surface
};
/// One view is enough: what no second one sees, or sees elsewhere, the check against the
/// neighbours' maps takes out.
constexpr Limits kAfterSearch{0.8f, 1.0f, 1};
/// Passes have settled the planes by what all views know: looks may differ more. On plaza, share of
/// all true pixels within 1 % and outliers after all checks: 79.8 % and 1.1 % with the limits
/// above, 84.2 % and 2.8 % with these (4 px then, of sigmas that were 0.8 times as large).
constexpr Limits kAfterPasses{1.0f, 5.0f, 0};
/// Least variance of the pixels that look like the centre (grey levels squared). A window of sky at
/// a roof has the roof's texture, and would get its depth.
constexpr float kMinTexture = 3.0f;
/// Largest cost where the texture is weak: that of noise, which is 1, and its scatter.
constexpr float kWeakCost = 1.1f, kMinWeakCost = 1e-6f;
/// Depths less sure than this, pixels of disparity, are held to the planes around them.
constexpr float kVaguePx = 0.6f;
/// The planes around a pixel are asked so often: what they have filled is around the next ones.
constexpr int kPriorPasses = 2;
/// Where no larger share of the pixels than this is without a sure depth, planes are not fitted:
/// more than this they could not add.
constexpr double kFewDoubtful = 0.002;
/// The planes around a pixel may cost so much more than its own, chosen as the cheapest.
constexpr float kPriorCost = 0.1f;
/// One row of so many is asked whether its pixels are ambiguous: what repeats covers more.
constexpr int kAskedRows = 8;
/// Single pixels find other places by chance, whole areas because their texture repeats: more than
/// half of the pixels asked, so many columns and rows of them to every side, must be ambiguous.
constexpr int kAskedAsideX = 6, kAskedAsideY = 1;
/// Inverse depths may miss the range by so many standard deviations.
constexpr float kRangeSigmas = 3.0f;
/// Log odds that a kept depth is wrong by more than 2 pixels of disparity, as a logistic regression
/// on plaza gives them (exact cameras, 2.3 million pixels; docs/accuracy/DEPTH.md): the views'
/// photos differ, few of them have a minimum there, the minimum is flat. Fitted to sigmas that were
/// about 0.8 times as large: the log odds are higher by 0.1 for it.
constexpr float kOddsOfWrong = -2.7f, kOddsPerCost = 3.6f, kOddsPerView = -0.44f;
constexpr float kOddsPerLogSigma = 0.44f, kMinSigmaPx = 0.02f;
/// What a wrong depth adds to sigma, pixels of disparity. Wrong depths are wrong by tens of pixels;
/// as much as that would make the right ones that look like them, which are more, too modest.
constexpr float kWrongByPx = 2.5f;

constexpr auto kExpectedSigmas = static_cast<float>(kPriorSigmas);

/// How likely the depth is wrong, from 0 to 1.
float ProbabilityOfWrong(const PixelEstimate& v) {
  const float odds = kOddsOfWrong + kOddsPerCost * std::min(v.cost, 1.0f) +
                     kOddsPerView * static_cast<float>(v.agreeing) +
                     kOddsPerLogSigma * std::log(v.sigma * v.px + kMinSigmaPx);
  return 1 / (1 + std::exp(-odds));
}

/// Standard deviation of a depth that is exact to v.sigma unless it is wrong.
float SigmaWithDoubt(const PixelEstimate& v) {
  return std::hypot(v.sigma, ProbabilityOfWrong(v) * kWrongByPx / v.px);
}

/// What the images say of a pixel and what the planes around it do, as independent measurements.
void Combine(float prior, float prior_sigma, PixelEstimate* v) {
  const float seen = v->sigma > 0 ? 1 / (v->sigma * v->sigma) : 0;
  const float expected = 1 / (prior_sigma * prior_sigma);
  v->w = (seen * v->w + expected * prior) / (seen + expected);
  v->sigma = 1 / std::sqrt(seen + expected);
}

/// Pixels of the row that asked row `v` stands for whose result an open pixel depends on.
std::vector<float> AskedFor(const Level& level, int v) {
  const int w = level.reference.width, h = level.reference.height;
  const int reach = 2 * (kAskedAsideX + 1);
  std::vector<float> wanted(static_cast<size_t>(w), 0);
  const int from = std::max(0, kAskedRows * (v - kAskedAsideY));
  const int to = std::min(h, kAskedRows * (v + kAskedAsideY + 1));
  for (int y = from; y < to; ++y) {
    const float* open = level.open->at(0, y);
    int filled = 0;
    for (int x = 0; x < w; ++x) {
      if (open[x] == 0) continue;
      filled = std::max(filled, x - reach);
      for (const int end = std::min(w, x + reach + 1); filled < end; ++filled) {
        wanted[static_cast<size_t>(filled)] = 1;
      }
    }
  }
  return wanted;
}

/// Makes holes of areas whose texture leaves several places open.
void RemoveAmbiguous(const Level& level, const State& state, DepthEstimate* estimate) {
  const int w = level.reference.width, h = level.reference.height;
  Grid<std::uint8_t> asked((w + 1) / 2, (h + kAskedRows - 1) / kAskedRows);
  ParallelFor(0, asked.height(), [&](int v) {
    const std::vector<float> wanted = level.open ? AskedFor(level, v) : std::vector<float>();
    AmbiguousRow(level, state, std::min(h - 1, kAskedRows * v + kAskedRows / 2),
                 level.open ? wanted.data() : nullptr, asked.row(v));
  });
  ParallelFor(0, asked.height(), [&](int v) {
    for (int u = 0; u < asked.width(); ++u) {
      int ambiguous = 0, all = 0;
      for (int j = std::max(0, v - kAskedAsideY);
           j <= std::min(asked.height() - 1, v + kAskedAsideY); ++j) {
        for (int i = std::max(0, u - kAskedAsideX);
             i <= std::min(asked.width() - 1, u + kAskedAsideX); ++i, ++all) {
          ambiguous += asked(i, j);
        }
      }
      if (2 * ambiguous <= all) continue;
      for (int y = kAskedRows * v; y < std::min(h, kAskedRows * (v + 1)); ++y) {
        for (int x = 2 * u; x < std::min(w, 2 * u + 2); ++x) {
          estimate->depth(x, y) = estimate->inverse_depth_sigma(x, y) = 0;
        }
      }
    }
  });
}

bool HasSurfaces(const Level& level) {
  return std::any_of(level.sources.begin(), level.sources.end(),
                     [](const Source& s) { return s.surface != nullptr; });
}

/// The validation results on all pixels of a view, as they come about.
class DepthFilter {
 public:
  DepthFilter(const Level& level, const StereoView& view, const DepthRange& range,
              const TimeStep* time_step, State* state)
      : level_(level),
        view_(view),
        near_z_(range.near_z),
        time_step_(time_step),
        typical_px_per_w_(time_step != nullptr ? MeanPxPerInverseDepth(level) : 0),
        state_(state),
        result_{DepthImage(width(), height()), Grid<float>(width(), height())} {}

  /// By what the images say of each pixel alone, and of whole areas.
  void KeepConsistent() {
    const Limits limits = HasSurfaces(level_) ? kAfterPasses : kAfterSearch;
    Grid<std::uint8_t> consistent(width(), height());
    ParallelFor(0, height(), [&](int y) {
      std::vector<PixelEstimate> row(static_cast<size_t>(width()));
      EstimateRow(level_, *state_, y, level_.open ? level_.open->at(0, y) : nullptr, row.data());
      for (int x = 0; x < width(); ++x) {
        const PixelEstimate& v = row[static_cast<size_t>(x)];
        if (IsSettled(x, y)) {
          KeepSettled(x, y);
          consistent(x, y) = kMaxViews;
          continue;
        }
        if (view_.mask != nullptr && !view_.mask->empty() && (*view_.mask)(x, y) == 0) continue;
        px_per_w_(x, y) = v.px;
        if (v.cost <= kWeakCost) cost_(x, y) = std::max(v.cost, kMinWeakCost);
        consistent(x, y) = static_cast<std::uint8_t>(v.consistent);
        const bool weak = !(v.texture >= kMinTexture) || !(v.sigma * v.px <= limits.sigma_px);
        if (weak || !(v.cost <= limits.cost) || v.agreeing < limits.agreeing) continue;
        if (v.sigma > 0) Keep(x, y, v);
      }
    });
    RemoveSpeckles(
        {px_per_w_, consistent, static_cast<float>(near_z_), level_.w_max - level_.w_min},
        &result_);
    RemoveAmbiguous(level_, *state_, &result_);
  }

  /// Gives a depth to what has none, and a better one to what is vague, where the planes around
  /// lead to one that the images do not speak against. False, and nothing is done, where that
  /// could be of use to hardly a pixel.
  bool FillFromPlanarPrior() {
    std::atomic<std::int64_t> doubtful{0};
    ParallelFor(0, height(), [&](int y) {
      std::int64_t in_row = 0;
      for (int x = 0; x < width(); ++x) {
        if (DepthImage::IsHole(result_.depth(x, y))) {
          believed_(x, y) = 0;
        } else if (!(sigma_px_(x, y) > kVaguePx)) {
          cost_(x, y) = 0;
        }
        in_row += cost_(x, y) != 0;
      }
      doubtful += in_row;
    });
    const double pixels = static_cast<double>(width()) * height();
    if (static_cast<double>(doubtful) <= kFewDoubtful * pixels) return false;
    const Prior prior =
        PlanarPrior(cost_, {believed_, sigma_px_, px_per_w_}, level_.reference, state_);
    ParallelFor(0, height(), [&](int y) {
      std::vector<PixelEstimate> row(static_cast<size_t>(width()));
      EstimateRow(level_, *state_, y, prior.w.row(y), row.data());
      for (int x = 0; x < width(); ++x) {
        PixelEstimate& v = row[static_cast<size_t>(x)];
        if (prior.w(x, y) == 0 || !(v.cost <= cost_(x, y) + kPriorCost)) continue;
        Combine(prior.w(x, y), prior.sigma(x, y), &v);
        Keep(x, y, v);
      }
    });
    return true;
  }

  /// Where another instrument has measured depth: gives it to pixels that the photos leave
  /// undecided, and makes vague depths that agree with it surer. Depths that contradict it stay.
  void FillFromDepthPrior() {
    if (!level_.expected) return;
    ParallelFor(0, height(), [&](int y) {
      std::vector<float> vague(static_cast<size_t>(width()), 0);
      for (int x = 0; x < width(); ++x) {
        const float certainty = *level_.expected->inverse_sigma.at(x, y);
        if (!(certainty > 0) || !(px_per_w_(x, y) > 0)) continue;
        if (DepthImage::IsHole(result_.depth(x, y))) {
          TakeExpected(x, y, 1 / certainty);
        } else if (sigma_px_(x, y) > kVaguePx) {
          vague[static_cast<size_t>(x)] = 1;
        }
      }
      std::vector<PixelEstimate> row(static_cast<size_t>(width()));
      EstimateRow(level_, *state_, y, vague.data(), row.data());
      for (int x = 0; x < width(); ++x) {
        if (vague[static_cast<size_t>(x)] == 0) continue;
        PixelEstimate& v = row[static_cast<size_t>(x)];
        const float w = *level_.expected->w.at(x, y);
        const float sigma = 1 / *level_.expected->inverse_sigma.at(x, y);
        if (std::abs(v.w - w) > kExpectedSigmas * std::hypot(v.sigma, sigma)) continue;
        Combine(w, sigma, &v);
        Keep(x, y, v);
      }
    });
  }

  DepthEstimate TakeResult() {
    if (time_step_ != nullptr) KeepSettledDepth(*time_step_, &result_);
    return std::move(result_);
  }

 private:
  int width() const { return level_.reference.width; }
  int height() const { return level_.reference.height; }

  bool IsSettled(int x, int y) const {
    return time_step_ != nullptr && time_step_->open(x, y) == 0;
  }

  /// What is around open pixels: company for small areas, and support of the planes between.
  void KeepSettled(int x, int y) {
    const float z = time_step_->settled.depth(x, y);
    if (DepthImage::IsHole(z)) return;
    const float sigma = time_step_->settled.inverse_depth_sigma(x, y);
    px_per_w_(x, y) = typical_px_per_w_;
    believed_(x, y) = static_cast<float>(near_z_ / static_cast<double>(z));
    sigma_px_(x, y) = static_cast<float>(static_cast<double>(sigma) * near_z_) * typical_px_per_w_;
    result_.depth(x, y) = z;
    result_.inverse_depth_sigma(x, y) = sigma;
  }

  void Keep(int x, int y, const PixelEstimate& v) {
    // What lies beyond the range by no more than it may be wrong lies at its end.
    const float slack = kRangeSigmas * v.sigma;
    if (!(v.w >= level_.w_min - slack) || !(v.w <= level_.w_max + slack)) return;
    believed_(x, y) = std::clamp(v.w, level_.w_min, level_.w_max);
    sigma_px_(x, y) = v.sigma * v.px;
    result_.depth(x, y) = static_cast<float>(near_z_ / static_cast<double>(believed_(x, y)));
    result_.inverse_depth_sigma(x, y) =
        static_cast<float>(static_cast<double>(SigmaWithDoubt(v)) / near_z_);
  }

  /// The plane of the state where it is one that is expected: the passes have made it agree with
  /// those of other views. Else the expected plane itself.
  void TakeExpected(int x, int y, float sigma) {
    const Expected& expected = *level_.expected;
    float& w = *state_->w.at(x, y);
    if (std::abs(w - *expected.w.at(x, y)) > kExpectedSigmas * sigma) {
      w = *expected.w.at(x, y);
      *state_->a.at(x, y) = *expected.a.at(x, y);
      *state_->b.at(x, y) = *expected.b.at(x, y);
    }
    believed_(x, y) = w;
    sigma_px_(x, y) = sigma * px_per_w_(x, y);
    result_.depth(x, y) = static_cast<float>(near_z_ / static_cast<double>(w));
    result_.inverse_depth_sigma(x, y) = static_cast<float>(static_cast<double>(sigma) / near_z_);
  }

  const Level& level_;
  const StereoView& view_;
  const double near_z_;
  const TimeStep* const time_step_;
  const float typical_px_per_w_;  ///< of settled pixels, whose planes are not looked at
  State* const state_;
  DepthEstimate result_;
  Grid<float> px_per_w_{width(), height()};
  Grid<float> believed_{width(), height()};  ///< inverse depth; 0: none
  Grid<float> sigma_px_{width(), height()};  ///< of it, without doubt
  Grid<float> cost_{width(), height()};      ///< of the pixel's plane; 0: the prior is not asked
};

}  // namespace

DepthEstimate FilteredDepth(const Level& level, const StereoView& view, const DepthRange& range,
                            const TimeStep* time_step, State* state, bool* planes_left_out) {
  DepthFilter filter(level, view, range, time_step, state);
  filter.KeepConsistent();
  filter.FillFromDepthPrior();
  int passes = 0;
  while (passes < kPriorPasses && filter.FillFromPlanarPrior()) ++passes;
  *planes_left_out = passes == 0;
  return filter.TakeResult();
}

}  // namespace dtr::stereo::patchmatch
