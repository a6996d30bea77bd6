#include "stereo/sgbm/fuse.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr::stereo {
namespace {

/// Two pairs agree when they differ by at most this, in pixels of disparity of the coarser one.
constexpr double kAgreePx = 1.0;
/// Noise of one disparity: SGBM's parabola through costs on whole pixels is drawn towards whole
/// pixels, which leaves 0.2 to 0.4 px (Szeliski and Scharstein, PAMI 2004, fig. 2).
constexpr double kNoisePx = 0.35;
/// From this many pairs on a single opinion is not enough.
constexpr int kPairsThatMustAgree = 3;

struct Opinion {
  int pair;
  double inverse_depth;
  double step;  ///< change of 1/z per pixel of disparity
};

/// Opinions on one depth, at most one per pair.
struct Group {
  std::vector<Opinion> members;
  double weight = 0;  ///< sum of 1 / step^2
};

/// The opinions that agree with `depth`; `opinions` are sorted by pair.
void Gather(const std::vector<Opinion>& opinions, const Opinion& depth, Group* group) {
  group->members.clear();
  group->weight = 0;
  for (size_t begin = 0; begin < opinions.size();) {
    const Opinion* closest = nullptr;
    double closest_px = kAgreePx;
    size_t end = begin;
    for (; end < opinions.size() && opinions[end].pair == opinions[begin].pair; ++end) {
      const double off_px = std::abs(opinions[end].inverse_depth - depth.inverse_depth) /
                            std::max(opinions[end].step, depth.step);
      if (off_px <= closest_px) closest_px = off_px, closest = &opinions[end];
    }
    begin = end;
    if (closest == nullptr) continue;
    group->members.push_back(*closest);
    group->weight += 1.0 / (closest->step * closest->step);
  }
}

/// Groups of equal size and baselines must not be told apart by rounding; the first one wins then.
constexpr double kHeavier = 1 + 1e-6;

struct FusedDepth {
  double inverse_depth = 0, sigma = 0;  ///< 0, 0: a hole
};

FusedDepth MeanOf(const Group& group) {
  double mean = 0, spread = 0;
  for (const Opinion& o : group.members) {
    mean += o.inverse_depth / (o.step * o.step) / group.weight;
  }
  for (const Opinion& o : group.members) {
    const double off = o.inverse_depth - mean;
    spread += off * off / (o.step * o.step) / group.weight;
  }
  const double variance =
      kNoisePx * kNoisePx / group.weight + spread / static_cast<double>(group.members.size());
  return {mean, std::sqrt(variance)};
}

/// Works through the pixels of one row; keeps its buffers.
class Voter {
 public:
  explicit Voter(int pair_count) : needed_(pair_count >= kPairsThatMustAgree ? 2 : 1) {}

  void Clear() { opinions_.clear(); }
  /// Opinions must come sorted by pair.
  void Add(const Opinion& opinion) { opinions_.push_back(opinion); }

  FusedDepth Vote() {
    best_.members.clear();
    best_.weight = 0;
    for (const Opinion& candidate : opinions_) {
      Gather(opinions_, candidate, &group_);
      if (group_.members.size() > best_.members.size() ||
          (group_.members.size() == best_.members.size() &&
           group_.weight > kHeavier * best_.weight)) {
        std::swap(group_, best_);
      }
    }
    const int votes = static_cast<int>(best_.members.size());
    if (votes < needed_ || (votes == 1 && Contradicted(best_.members.front()))) return {};
    return MeanOf(best_);
  }

 private:
  /// Whether any opinion, of any sweep, differs from a lone one.
  bool Contradicted(const Opinion& lone) const {
    return std::any_of(opinions_.begin(), opinions_.end(), [&](const Opinion& o) {
      return std::abs(o.inverse_depth - lone.inverse_depth) >
             kAgreePx * std::max(o.step, lone.step);
    });
  }

  int needed_;
  std::vector<Opinion> opinions_;
  Group group_, best_;
};

}  // namespace

DepthEstimate FusePairs(const PinholeCamera& camera, const Mask* mask,
                        std::span<const PairDepth> sweeps, int pair_count,
                        const DepthRange& range) {
  const int w = camera.width_px(), h = camera.height_px();
  DepthEstimate result{DepthImage(w, h), Grid<float>(w, h)};
  ParallelFor(0, h, [&](int y) {
    Voter voter(pair_count);
    for (int x = 0; x < w; ++x) {
      if (mask != nullptr && !mask->empty() && (*mask)(x, y) == 0) continue;
      voter.Clear();
      const Eigen::Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
      for (const PairDepth& sweep : sweeps) {
        const float inverse_depth = sweep.inverse_depth(x, y);
        if (!std::isnan(inverse_depth)) {
          voter.Add({sweep.pair, inverse_depth, sweep.StepAt(ray)});
        }
      }
      const FusedDepth fused = voter.Vote();
      if (!(fused.inverse_depth >= 1.0 / range.far_z) ||
          !(fused.inverse_depth <= 1.0 / range.near_z)) {
        continue;
      }
      result.depth(x, y) = static_cast<float>(1.0 / fused.inverse_depth);
      result.inverse_depth_sigma(x, y) = static_cast<float>(fused.sigma);
    }
  });
  return result;
}

void RemoveSpeckles(const PinholeCamera& camera, std::span<const PairDepth> sweeps, int min_pixels,
                    double max_steps, DepthEstimate* estimate) {
  const int w = camera.width_px(), h = camera.height_px();
  DepthImage& depth = estimate->depth;
  Grid<std::uint8_t> seen(w, h);
  std::vector<int> area;
  const auto connected = [&](int a, int b) {
    const int x = a % w, y = a / w;
    double step = std::numeric_limits<double>::infinity();
    const Eigen::Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
    for (const PairDepth& sweep : sweeps) step = std::min(step, sweep.StepAt(ray));
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
