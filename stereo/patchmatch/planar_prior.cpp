#include "stereo/patchmatch/planar_prior.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "dtr/base/parallel_for.h"

namespace dtr::stereo::patchmatch {
namespace {

/// Reliable pixels farther away than this say nothing. Sky between branches is enclosed too, but
/// seldom this closely. See docs/accuracy/DEPTH.md.
constexpr int kReachPx = 16;
constexpr int kDirections[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};

struct Plane {
  float w = 0, a = 0, b = 0;
};

/// The nearest reliable plane in one direction, continued to (x, y).
std::optional<Plane> NextPlane(const State& state, const DepthImage& reliable, int x, int y, int dx,
                               int dy) {
  for (int k = 1; k <= kReachPx; ++k) {
    const int u = x + k * dx, v = y + k * dy;
    if (!reliable.Contains(u, v)) return {};
    if (DepthImage::IsHole(reliable(u, v))) continue;
    const float a = *state.a.at(u, v), b = *state.b.at(u, v);
    return Plane{
        *state.w.at(u, v) - static_cast<float>(k * dx) * a - static_cast<float>(k * dy) * b, a, b};
  }
  return {};
}

/// Mean of the four planes around a pixel when all lead to it.
std::optional<Plane> PriorAt(const State& state, const DepthImage& reliable, int x, int y,
                             float px_per_w) {
  Plane around[4], mean;
  for (int i = 0; i < 4; ++i) {
    const auto plane = NextPlane(state, reliable, x, y, kDirections[i][0], kDirections[i][1]);
    if (!plane) return {};
    around[i] = *plane;
    mean.w += 0.25f * plane->w;
    mean.a += 0.25f * plane->a;
    mean.b += 0.25f * plane->b;
  }
  for (const Plane& plane : around) {
    if (!(std::abs(plane.w - mean.w) * px_per_w <= kPriorSigmaPx)) return {};
  }
  return mean;
}

}  // namespace

Grid<float> PlanarPrior(const Grid<float>& wanted, const DepthImage& reliable,
                        const Grid<float>& px_per_w, int threads, State* state) {
  const int width = wanted.width(), height = wanted.height();
  Grid<float> prior(width, height);
  // Reliable planes are read and others written.
  ParallelFor(0, height, threads, [&](int y) {
    for (int x = 0; x < width; ++x) {
      if (wanted(x, y) == 0) continue;
      const auto plane = PriorAt(*state, reliable, x, y, px_per_w(x, y));
      if (!plane || !(plane->w > 0)) continue;
      prior(x, y) = plane->w;
      if (std::abs(*state->w.at(x, y) - plane->w) * px_per_w(x, y) <= kPriorSigmaPx) continue;
      *state->w.at(x, y) = plane->w;
      *state->a.at(x, y) = plane->a;
      *state->b.at(x, y) = plane->b;
    }
  });
  return prior;
}

}  // namespace dtr::stereo::patchmatch
