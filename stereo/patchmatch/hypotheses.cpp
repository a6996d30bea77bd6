#include "stereo/patchmatch/hypotheses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace dtr::stereo::patchmatch {
namespace {

using Matrix = Eigen::Matrix3f;
using Vector = Eigen::Vector3f;

/// Closer planes than this, in pixels of disparity, are what the pixel has already.
constexpr float kSamePx = 0.5f;

/// Pixels that the point at `share` of the image's width and height moves in a source per unit of
/// inverse depth; 0 where the source does not see all of its ray.
float PxPerInverseDepthAt(const Level& level, const Source& s, const Eigen::Vector2f& share) {
  const Matrix m = Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(s.m);
  const Vector k = Eigen::Map<const Vector>(s.k);
  const Vector pixel(share.x() * static_cast<float>(level.reference.width),
                     share.y() * static_cast<float>(level.reference.height), 1.0f);
  const Vector near = m * pixel + level.w_max * k, far = m * pixel + level.w_min * k;
  if (!(near.z() > 0) || !(far.z() > 0)) return 0;
  return (near.hnormalized() - far.hnormalized()).norm() / (level.w_max - level.w_min);
}

/// Of the image's centre; where that is near the epipole (forward motion) or behind the source,
/// the largest of the corners, which see what the centre cannot.
float PxPerInverseDepth(const Level& level, const Source& s) {
  constexpr float kNearEpipole = 0.25f;  // of what the corners move
  const float centre = PxPerInverseDepthAt(level, s, {0.5f, 0.5f});
  float corners = 0;
  for (const float x : {0.0f, 1.0f}) {
    for (const float y : {0.0f, 1.0f}) {
      corners = std::max(corners, PxPerInverseDepthAt(level, s, {x, y}));
    }
  }
  return centre > kNearEpipole * corners ? centre : corners;
}

void Put(State::Hypothesis* hypothesis, int x, int y, float w, const Vector& plane) {
  *hypothesis->w.at(x, y) = w;
  *hypothesis->a.at(x, y) = plane.x();
  *hypothesis->b.at(x, y) = plane.y();
}

}  // namespace

float MeanPxPerInverseDepth(const Level& level) {
  float sum = 0;
  for (const Source& s : level.sources) sum += PxPerInverseDepth(level, s);
  return sum / static_cast<float>(level.sources.size());
}

void HypothesesFromSurfaces(const Level& level, State* state) {
  const int width = level.reference.width, height = level.reference.height;
  const BorderedGrid none(width, height, 0);
  state->hypotheses.assign(2, {none, none, none});
  State::Hypothesis *nearest = &state->hypotheses[0], *farthest = &state->hypotheses[1];
  for (const Source& s : level.sources) {
    if (s.surface == nullptr) continue;
    const Matrix m = Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(s.back_m);
    const Vector k = Eigen::Map<const Vector>(s.back_k);
    const Matrix inverse_transposed = m.inverse().transpose();
    const float px_per_inverse_depth = PxPerInverseDepth(level, s);
    if (!(px_per_inverse_depth > 0)) continue;  // it says nothing of depth here
    const float same = kSamePx / px_per_inverse_depth;
    const PlaneMap& map = *s.surface;
    for (int v = 0; v < map.inverse_depth.height(); ++v) {
      for (int u = 0; u < map.inverse_depth.width(); ++u) {
        const float w = s.surface_scale * map.inverse_depth(u, v);
        if (!(w > 0)) continue;
        const Vector at(static_cast<float>(u + kTextureBorder),
                        static_cast<float>(v + kTextureBorder), 1.0f);
        const Vector seen = m * at + w * k;
        if (!(seen.z() > 0)) continue;
        const float px = seen.x() / seen.z(), py = seen.y() / seen.z();
        if (!(px >= 0) || !(py >= 0) || !(px < static_cast<float>(width)) ||
            !(py < static_cast<float>(height))) {
          continue;
        }
        const int x = static_cast<int>(px), y = static_cast<int>(py);
        if (level.open && *level.open->at(x, y) == 0) continue;
        // In the source 1/z = n . (u, v, 1), so H = m + k n^T and here 1/z = H^-T n . (x, y, 1);
        // H^-T n = m^-T n / (1 + k . m^-T n) (Sherman and Morrison, 1950).
        Vector n(s.surface_scale * map.slope_x(u, v), s.surface_scale * map.slope_y(u, v), 0);
        n.z() = w - n.dot(at);
        const Vector q = inverse_transposed * n;
        const Vector plane = q / (1 + k.dot(q));
        const float here =
            plane.dot(Vector(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 1.0f));
        if (!(here >= level.w_min) || !(here <= level.w_max)) continue;
        if (std::abs(here - *state->w.at(x, y)) < same) continue;
        if (here > *nearest->w.at(x, y)) Put(nearest, x, y, here, plane);
        const float far = *farthest->w.at(x, y);
        if (far == 0 || here < far) Put(farthest, x, y, here, plane);
      }
    }
  }
}

}  // namespace dtr::stereo::patchmatch
