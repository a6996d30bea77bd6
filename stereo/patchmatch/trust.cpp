#include "stereo/patchmatch/trust.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"

namespace dtr::stereo::patchmatch {
namespace {

/// Largest cost (1 - NCC, weighted mean of the views that count) of a pixel that is kept.
constexpr float kLargestCost = 0.8f;
/// Largest standard deviation of a kept pixel, pixels of disparity.
constexpr float kLargestSigmaPx = 1.0f;
/// Views that must see the surface. One is enough: what no second one sees, or sees elsewhere, the
/// check against the neighbours' maps takes out.
constexpr int kViewsThatMustAgree = 1;
/// Least variance of the pixels that look like the centre (grey levels squared). A window of sky at
/// a roof has the roof's texture, and would get its depth.
constexpr float kLeastTexture = 3.0f;
/// Connected areas smaller than this share of the image are taken for chance matches. Pixels
/// connect across at most this many pixels of disparity.
constexpr double kSpeckleShare = 1e-4;
constexpr float kSpeckleStepPx = 1.0f;

/// Makes holes of small connected areas.
void RemoveSpeckles(const Grid<float>& px_per_w, float near_z, DepthEstimate* estimate) {
  const int w = px_per_w.width(), h = px_per_w.height();
  const int least = static_cast<int>(std::ceil(kSpeckleShare * w * h));
  DepthImage& depth = estimate->depth;
  Grid<std::uint8_t> seen(w, h);
  std::vector<std::pair<int, int>> area;
  for (int y0 = 0; y0 < h; ++y0) {
    for (int x0 = 0; x0 < w; ++x0) {
      if (seen(x0, y0) || DepthImage::IsHole(depth(x0, y0))) continue;
      area.assign(1, {x0, y0});
      seen(x0, y0) = 1;
      for (size_t next = 0; next < area.size(); ++next) {
        const auto [x, y] = area[next];
        for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
          const int u = x + dx, v = y + dy;
          if (!depth.Contains(u, v) || seen(u, v) || DepthImage::IsHole(depth(u, v))) continue;
          const float step = near_z / depth(x, y) - near_z / depth(u, v);
          if (std::abs(step) * px_per_w(x, y) > kSpeckleStepPx) continue;
          seen(u, v) = 1;
          area.emplace_back(u, v);
        }
      }
      if (static_cast<int>(area.size()) >= least) continue;
      for (const auto& [x, y] : area) depth(x, y) = estimate->inverse_depth_sigma(x, y) = 0;
    }
  }
}

}  // namespace

DepthEstimate TrustedDepth(const Level& level, const State& state, const StereoView& view,
                           const DepthRange& range, int threads) {
  const int w = level.reference.width, h = level.reference.height;
  DepthEstimate result{DepthImage(w, h), Grid<float>(w, h)};
  Grid<float> px_per_w(w, h);
  ParallelFor(0, h, threads, [&](int y) {
    std::vector<Verdict> row(static_cast<size_t>(w));
    JudgeRow(level, state, y, row.data());
    for (int x = 0; x < w; ++x) {
      const Verdict& v = row[static_cast<size_t>(x)];
      if (view.mask != nullptr && !view.mask->empty() && (*view.mask)(x, y) == 0) continue;
      if (!(v.cost <= kLargestCost) || v.agreeing < kViewsThatMustAgree) continue;
      if (!(v.texture >= kLeastTexture)) continue;
      if (!(v.sigma * v.px <= kLargestSigmaPx) || !(v.sigma > 0)) continue;
      if (!(v.w >= level.w_min) || !(v.w <= level.w_max)) continue;
      result.depth(x, y) = static_cast<float>(range.near_z / static_cast<double>(v.w));
      result.inverse_depth_sigma(x, y) =
          static_cast<float>(static_cast<double>(v.sigma) / range.near_z);
      px_per_w(x, y) = v.px;
    }
  });
  RemoveSpeckles(px_per_w, static_cast<float>(range.near_z), &result);
  return result;
}

}  // namespace dtr::stereo::patchmatch
