#include "stereo/sgbm/fuse.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"

namespace dtr::stereo {
namespace {

/// Two pairs agree when they differ by at most this, in pixels of disparity of the coarser one.
constexpr double kAgreePx = 1.0;
/// Noise of one disparity: SGBM's parabola through costs on whole pixels is drawn towards whole
/// pixels, which leaves 0.2 to 0.4 px (Szeliski and Scharstein, PAMI 2004, fig. 2).
constexpr double kNoisePx = 0.35;
/// From this many pairs on a single opinion is not enough.
constexpr size_t kPairsThatMustAgree = 3;

struct Opinion {
  double inverse_depth;
  double step;  ///< change of 1/z per pixel of disparity
};

struct Verdict {
  double inverse_depth = 0, sigma = 0;  ///< 0, 0: a hole
};

Verdict Vote(const std::vector<Opinion>& opinions, size_t pairs) {
  size_t best_count = 0, best = 0;
  double best_weight = 0;
  const auto agree = [&](size_t i, size_t j) {
    return std::abs(opinions[i].inverse_depth - opinions[j].inverse_depth) <=
           kAgreePx * std::max(opinions[i].step, opinions[j].step);
  };
  for (size_t i = 0; i < opinions.size(); ++i) {
    size_t count = 0;
    double weight = 0;
    for (size_t j = 0; j < opinions.size(); ++j) {
      if (!agree(i, j)) continue;
      ++count;
      weight += 1.0 / (opinions[j].step * opinions[j].step);
    }
    if (count > best_count || (count == best_count && weight > best_weight)) {
      best_count = count, best_weight = weight, best = i;
    }
  }
  const size_t needed = pairs >= kPairsThatMustAgree ? 2 : 1;
  if (best_count < needed || opinions.size() - best_count >= best_count) return {};

  double mean = 0;
  for (size_t j = 0; j < opinions.size(); ++j) {
    if (agree(best, j)) {
      mean += opinions[j].inverse_depth / (opinions[j].step * opinions[j].step) / best_weight;
    }
  }
  double spread = 0;
  for (size_t j = 0; j < opinions.size(); ++j) {
    const double off = opinions[j].inverse_depth - mean;
    if (agree(best, j)) spread += off * off / (opinions[j].step * opinions[j].step) / best_weight;
  }
  // The pull to whole pixels is common to the pairs only in part; spread says how much is left.
  const double variance =
      kNoisePx * kNoisePx / best_weight + spread / static_cast<double>(best_count);
  return {mean, std::sqrt(variance)};
}

}  // namespace

DepthEstimate FusePairs(const PinholeCamera& camera, const std::vector<PairDepth>& pairs,
                        const DepthRange& range, int threads) {
  const int w = camera.width_px(), h = camera.height_px();
  DepthEstimate result{DepthImage(w, h), Grid<float>(w, h)};
  ParallelFor(0, h, threads, [&](int y) {
    std::vector<Opinion> opinions;
    for (int x = 0; x < w; ++x) {
      opinions.clear();
      for (const PairDepth& pair : pairs) {
        const float inverse_depth = pair.inverse_depth(x, y);
        if (!std::isnan(inverse_depth)) {
          opinions.push_back({inverse_depth, pair.StepAt(camera, x, y)});
        }
      }
      if (opinions.empty()) continue;
      const Verdict verdict = Vote(opinions, pairs.size());
      if (verdict.inverse_depth < 1.0 / range.far_z || verdict.inverse_depth > 1.0 / range.near_z) {
        continue;
      }
      result.depth(x, y) = static_cast<float>(1.0 / verdict.inverse_depth);
      result.inverse_depth_sigma(x, y) = static_cast<float>(verdict.sigma);
    }
  });
  return result;
}

void RemoveSpeckles(const PinholeCamera& camera, const std::vector<PairDepth>& pairs,
                    int min_pixels, double max_steps, DepthEstimate* estimate) {
  const int w = camera.width_px(), h = camera.height_px();
  DepthImage& depth = estimate->depth;
  Grid<std::uint8_t> seen(w, h);
  std::vector<int> area;
  const auto connected = [&](int a, int b) {
    const int x = a % w, y = a / w;
    double step = std::numeric_limits<double>::infinity();
    for (const PairDepth& pair : pairs) step = std::min(step, pair.StepAt(camera, x, y));
    const double za = depth(x, y), zb = depth(b % w, b / w);
    return std::abs(1.0 / za - 1.0 / zb) <= max_steps * step;
  };
  for (int start = 0; start < w * h; ++start) {
    if (seen(start % w, start / w) || DepthImage::IsHole(depth(start % w, start / w))) continue;
    area.assign(1, start);
    seen(start % w, start / w) = 1;
    for (size_t next = 0; next < area.size(); ++next) {
      const int x = area[next] % w, y = area[next] / w;
      for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const int u = x + dx, v = y + dy;
        if (!depth.Contains(u, v) || seen(u, v) || DepthImage::IsHole(depth(u, v))) continue;
        if (!connected(area[next], v * w + u)) continue;
        seen(u, v) = 1;
        area.push_back(v * w + u);
      }
    }
    if (static_cast<int>(area.size()) >= min_pixels) continue;
    for (const int i : area) {
      depth(i % w, i / w) = 0;
      estimate->inverse_depth_sigma(i % w, i / w) = 0;
    }
  }
}

}  // namespace dtr::stereo
