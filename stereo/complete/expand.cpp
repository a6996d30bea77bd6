#include "stereo/complete/expand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include "dtr/render/exposure.h"
#include "dtr/render/colour.h"

namespace dtr::stereo {
namespace {

constexpr float kAlike = 10;    // levels, between a pixel and a cell
constexpr float kSamePx = 1;    // cells of disparity

}  // namespace

DepthImage ExpandCells(const View& view, const CellView& cells, const CompletedCells& completed,
                       int cell_px, float far_z) {
  const int scale = view.depth_scale;
  DepthImage depth(view.depth.width(), view.depth.height());
  std::array<std::array<float, 256>, 3> levels{};
  for (int c = 0; c < 3; ++c) {
    for (int v = 0; v < 256; ++v) {
      levels[static_cast<size_t>(c)][static_cast<size_t>(v)] = static_cast<float>(
          255 * SrgbFromLinear(Exposed(LinearFromSrgb(v / 255.0), view.gain[c])));
    }
  }
  const auto size = static_cast<float>(cell_px);
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (!DepthImage::IsHole(view.depth(x, y))) continue;
      const int px = std::min(x * scale + scale / 2, view.image.width() - 1);
      const int py = std::min(y * scale + scale / 2, view.image.height() - 1);
      if (!view.mask.empty() && view.mask(px, py) == 0) continue;
      const float u = (static_cast<float>(px) + 0.5F) / size, v = (static_cast<float>(py) + 0.5F) / size;
      const Eigen::Vector3f ray = cells.RayAt(u, v);
      const int cx = static_cast<int>(u), cy = static_cast<int>(v);
      if (!completed.PlaneAt(std::min(cx, cells.colour.width() - 1), std::min(cy, cells.colour.height() - 1)).allFinite()) continue;
      std::array<float, 9> weight{}, w{};
      int n = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int i = cx + dx, j = cy + dy;
          if (!cells.usable.Contains(i, j) || !cells.usable(i, j)) continue;
          float off = 0;
          for (int c = 0; c < 3; ++c) {
            off += std::abs(levels[static_cast<size_t>(c)][view.image(px, py, c)] -
                            cells.colour(i, j, c)) / 3;
          }
          const float du = u - static_cast<float>(i) - 0.5F, dv = v - static_cast<float>(j) - 0.5F;
          const ViewPlane plane = completed.PlaneAt(i, j);
          if (!plane.allFinite()) continue;
          weight[n] = std::exp(-(du * du + dv * dv) - off / kAlike);
          w[n] = std::max(0.0F, plane.dot(ray));
          ++n;
        }
      }
      float best = -1, chosen = 0;
      for (int a = 0; a < n; ++a) {
        float sum = 0, mean = 0;
        for (int b = 0; b < n; ++b) {
          if (std::abs(w[a] - w[b]) > kSamePx * cells.pixel) continue;
          sum += weight[b], mean += weight[b] * w[b];
        }
        if (sum > best) best = sum, chosen = mean / sum;
      }
      if (best < 0) continue;
      depth(x, y) = chosen * far_z > 1 ? 1 / chosen : far_z;
    }
  }
  return depth;
}

CompletedCells KeepSupported(const CellView& view, const CompletedCells& completed,
                             std::span<const CellView* const> others,
                             std::span<const CompletedCells* const> completed_others, int mode,
                             float support_px) {
  CompletedCells kept = completed;
  const int columns = view.colour.width(), rows = view.colour.height();
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (view.inverse_depth(x, y) > 0) continue;
      const Eigen::Vector3f ray = view.RayAt(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
      const float w = std::max(completed.PlaneAt(x, y).dot(ray), 1e-4F * view.pixel);
      bool supported = false, shown = false;
      for (size_t o = 0; o < others.size() && !supported; ++o) {
        const CellView& cells = *others[o];
        const Pose pose = cells.cam_from_world * view.cam_from_world.Inverse();
        const Eigen::Vector3d p = pose * (ray / w).cast<double>();
        const auto at = cells.camera.PixelFromCam(p);
        if (!at || !cells.camera.Contains(*at)) continue;
        const auto there = static_cast<float>(1 / p.z());
        const auto u = static_cast<float>(at->x()), v = static_cast<float>(at->y());
        bool nearer = false;
        const int R = getenv("J_R") ? atoi(getenv("J_R")) : 0;
        for (int j = -R; j <= R && !supported; ++j) {
          for (int i = -R; i <= R && !supported; ++i) {
            const int cx = static_cast<int>(u) + i, cy = static_cast<int>(v) + j;
            if (!cells.usable.Contains(cx, cy) || !cells.usable(cx, cy)) continue;
            const float off = completed_others[o]->PlaneAt(cx, cy).dot(cells.RayAt(u, v)) - there;
            supported = std::abs(off) <= support_px * cells.pixel;
            if (i == 0 && j == 0) nearer = off > support_px * cells.pixel;
          }
        }
        if (!nearer) shown = true;
      }
      if (supported || (mode != 1 && !shown && (mode == 0 || completed.on_scene_plane(x, y)))) continue;
      for (int c = 0; c < 3; ++c) kept.planes(x, y, c) = std::numeric_limits<float>::quiet_NaN();
    }
  }
  return kept;
}

}  // namespace dtr::stereo
