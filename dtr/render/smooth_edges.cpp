#include "dtr/render/smooth_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"

namespace dtr {
namespace {

// SPEC 8.1: the bend of inverse depth, as a share of the nearest surface's, from which on a pixel
// is on an edge, and fully so.
constexpr float kLeastBend = 0.02f, kFullBend = 0.04f;
// SPEC 8.2: the middle row and column of the mean against those beside them.
constexpr int kMiddleWeight = 3;

/// 1/z of three rows, 0 at holes, with a hole outside either end.
class InverseDepthRows {
 public:
  explicit InverseDepthRows(int width) : width_(width) {
    for (auto& row : rows_) row.assign(static_cast<size_t>(width) + 2, 0.0f);
  }

  void MoveTo(const Grid<float>& depth, int y) {
    for (int j = -1; j <= 1; ++j) {
      float* const row = rows_[static_cast<size_t>(j + 1)].data() + 1;
      if (y + j < 0 || y + j >= depth.height()) continue;  // Bend asks for nothing there
      const float* const z = depth.row(y + j);
      for (int x = 0; x < width_; ++x) row[x] = z[x] > 0 ? 1 / z[x] : 0;
    }
  }

  /// At row `j` of -1, 0, 1.
  float operator()(int x, int j) const { return rows_[static_cast<size_t>(j + 1)][Index(x)]; }

 private:
  static size_t Index(int x) { return static_cast<size_t>(x + 1); }
  int width_;
  std::array<std::vector<float>, 3> rows_;
};

/// What lies around a pixel.
struct Edge {
  float strength = 0;          ///< SPEC 8.1, in [0, 1]
  float nearest_inverse_depth = 0;
};

/// SPEC 8.1, from the pixel's four pairs of opposite neighbours inside the image.
Edge EdgeAt(const InverseDepthRows& rows, int x, bool beside, bool above_and_below) {
  const float middle = rows(x, 0);
  Edge edge{0, middle};
  const auto look = [&](int i, int j) {
    const float a = rows(x - i, -j), b = rows(x + i, j);
    const float nearest = std::max({a, middle, b});
    edge.nearest_inverse_depth = std::max(edge.nearest_inverse_depth, nearest);
    if (!(nearest > 0)) return;
    const float bend = std::abs(a - 2 * middle + b) / nearest;
    edge.strength = std::max(edge.strength, (bend - kLeastBend) / (kFullBend - kLeastBend));
  };
  if (beside) look(1, 0);
  if (above_and_below) look(0, 1);
  if (beside && above_and_below) look(1, 1), look(1, -1);
  edge.strength = std::min(edge.strength, 1.0f);
  return edge;
}

class EdgeSmoother {
 public:
  EdgeSmoother(const PinholeCamera& novel, std::span<const Eigen::Vector3d> view_centres,
               const Grid<float>& depth, bool holes_are_filled, ImageRgb8& image)
      : novel_(novel),
        view_centres_(view_centres),
        depth_(depth),
        holes_are_filled_(holes_are_filled),
        plain_(image),
        image_(image) {}

  void SmoothRow(int y) {
    InverseDepthRows rows(depth_.width());
    rows.MoveTo(depth_, y);
    const bool inside_y = y > 0 && y + 1 < depth_.height();
    for (int x = 0; x < depth_.width(); ++x) {
      if (!IsShown(x, y)) continue;
      const Edge edge = EdgeAt(rows, x, x > 0 && x + 1 < depth_.width(), inside_y);
      if (!(edge.strength > 0)) continue;
      const double strength = edge.strength * Displacement(x, y, edge.nearest_inverse_depth);
      if (strength > 0) Smooth(x, y, strength);
    }
  }

 private:
  bool IsShown(int x, int y) const { return holes_are_filled_ || depth_(x, y) > 0; }

  /// SPEC 8.3: by how many pixels, at most 1, the edge is displaced against the far background from
  /// here to the nearest photo. `w`: 1/z of the edge.
  double Displacement(int x, int y, double w) const {
    const Eigen::Vector3d ray = novel_.RayFromPixel({x + 0.5, y + 0.5});
    double least = 1;
    for (const Eigen::Vector3d& centre : view_centres_) {
      const double along = ray.squaredNorm() - w * ray.dot(centre);
      if (!(along > 0)) continue;
      least = std::min(least, novel_.fx_px() * w * ray.cross(centre).norm() / along);
    }
    return least;
  }

  void Smooth(int x, int y, double strength) {
    const std::array<double, 256>& linear = LinearFromSrgb8();
    std::array<double, 3> sum{};
    double total = 0;
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, depth_.height() - 1); ++v) {
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, depth_.width() - 1); ++u) {
        if (!IsShown(u, v)) continue;
        const double weight = (u == x ? kMiddleWeight : 1) * (v == y ? kMiddleWeight : 1);
        const std::uint8_t* const rgb = &plain_(u, v);
        total += weight;
        for (size_t c = 0; c < 3; ++c) sum[c] += weight * linear[rgb[c]];
      }
    }
    for (size_t c = 0; c < 3; ++c) {
      std::uint8_t& value = image_(x, y, static_cast<int>(c));
      value = Srgb8FromLinear((1 - strength) * linear[value] + strength * sum[c] / total);
    }
  }

  const PinholeCamera& novel_;
  const std::span<const Eigen::Vector3d> view_centres_;
  const Grid<float>& depth_;
  const bool holes_are_filled_;
  const ImageRgb8 plain_;  ///< as it was: smoothed pixels are no source of others
  ImageRgb8& image_;
};

}  // namespace

void SmoothEdges(const PinholeCamera& novel, std::span<const Eigen::Vector3d> view_centres,
                 const Grid<float>& depth, bool holes_are_filled, int threads, ImageRgb8& image) {
  EdgeSmoother smoother(novel, view_centres, depth, holes_are_filled, image);
  ParallelFor(0, depth.height(), threads, [&](int y) { smoother.SmoothRow(y); });
}

}  // namespace dtr
