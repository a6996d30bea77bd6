#include "dtr/render/smooth_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
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
constexpr float kMiddleWeight = 3;
// What a thread takes at once, so that most rows are inverted once.
constexpr int kRowsTogether = 16;

/// 1/z of three rows, 0 at holes and outside the image.
class InverseDepthRows {
 public:
  explicit InverseDepthRows(const RenderResult& result) : result_(result) {
    for (auto& row : rows_) row.assign(static_cast<size_t>(result.image.width()) + 2, 0.0f);
  }

  /// Rows y - 1, y and y + 1 from now on.
  void StartAt(int y) {
    Read(y - 1, 1), Read(y, 2);
    MoveTo(y);
  }
  /// The same, after y - 1.
  void MoveTo(int y) {
    std::swap(rows_[0], rows_[1]);
    std::swap(rows_[1], rows_[2]);
    Read(y + 1, 2);
  }

  /// Row `j` of -1, 0, 1, from x = -1 on at index -1.
  const float* Row(int j) const { return rows_[static_cast<size_t>(j + 1)].data() + 1; }

 private:
  void Read(int y, size_t slot) {
    const int width = result_.image.width();
    float* const row = rows_[slot].data() + 1;
    if (y < 0 || y >= result_.image.height()) {
      std::fill_n(row, width, 0.0f);
      return;
    }
    const float* const z = result_.depth.grid().row(y);
    const std::uint8_t* const seen = result_.coverage.row(y);
    for (int x = 0; x < width; ++x) row[x] = seen[x] != 0 && z[x] > 0 ? 1 / z[x] : 0;
  }

  const RenderResult& result_;
  std::array<std::vector<float>, 3> rows_;
};

/// What lies around a pixel.
struct Edge {
  float strength = 0;               ///< SPEC 8.1, in [0, 1]
  float nearest_inverse_depth = 0;  ///< of the pixel and those around
};

/// SPEC 8.1, from the pairs of opposite neighbours that lie inside the image.
Edge EdgeAt(const InverseDepthRows& rows, int x, bool beside, bool above_and_below) {
  const float middle = rows.Row(0)[x];
  Edge edge{0, middle};
  const auto look = [&](int i, int j) {
    const float a = rows.Row(-j)[x - i], b = rows.Row(j)[x + i];
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

/// 1 where a pixel may lie on an edge: a loop without branches or divisions, which compilers turn
/// into vector instructions. Pixels at the image's border always may.
void FindCandidates(const InverseDepthRows& rows, std::vector<std::uint8_t>& candidates) {
  const auto width = static_cast<int>(candidates.size());
  const float *const above = rows.Row(-1), *const here = rows.Row(0), *const below = rows.Row(1);
  const auto excess = [](float a, float middle, float b) {
    return std::abs(a - 2 * middle + b) - kLeastBend * std::max(std::max(a, middle), b);
  };
  for (int x = 0; x < width; ++x) {
    const float w = here[x];
    const float straight =
        std::max(excess(here[x - 1], w, here[x + 1]), excess(above[x], w, below[x]));
    const float diagonal =
        std::max(excess(above[x - 1], w, below[x + 1]), excess(below[x - 1], w, above[x + 1]));
    candidates[static_cast<size_t>(x)] = std::max(straight, diagonal) > 0 ? 1 : 0;
  }
  candidates.front() = candidates.back() = 1;
}

/// Linear light of the 8-bit values.
std::array<float, 256> LinearTable() {
  std::array<float, 256> table;
  std::copy(LinearFromSrgb8().begin(), LinearFromSrgb8().end(), table.begin());
  return table;
}

class EdgeSmoother {
 public:
  EdgeSmoother(const PinholeCamera& novel, std::span<const Eigen::Vector3d> view_centres,
               bool holes_are_filled, RenderResult& result)
      : novel_(novel),
        view_centres_(view_centres),
        holes_are_filled_(holes_are_filled),
        width_(result.image.width()),
        height_(result.image.height()),
        linear_(LinearTable()),
        plain_(result.image),
        result_(result) {}

  void SmoothRows(int first, int end) {
    InverseDepthRows rows(result_);
    std::vector<std::uint8_t> candidates(static_cast<size_t>(width_));
    for (int y = first; y < end; ++y) {
      y == first ? rows.StartAt(y) : rows.MoveTo(y);
      FindCandidates(rows, candidates);
      const bool inside_y = y > 0 && y + 1 < height_;
      for (int x = 0; x < width_; ++x) {
        if ((inside_y && candidates[static_cast<size_t>(x)] == 0) || !IsShown(x, y)) continue;
        const Edge edge = EdgeAt(rows, x, x > 0 && x + 1 < width_, inside_y);
        if (!(edge.strength > 0)) continue;
        const double strength = edge.strength * Displacement(x, y, edge.nearest_inverse_depth);
        if (strength > 0) Smooth(x, y, static_cast<float>(strength));
      }
    }
  }

 private:
  bool IsShown(int x, int y) const { return holes_are_filled_ || result_.coverage(x, y) != 0; }

  /// SPEC 8.3: by how many pixels, at most 1, the edge is displaced against the far background from
  /// here to the nearest photo. `w`: 1/z of the edge.
  double Displacement(int x, int y, double w) const {
    const Eigen::Vector3d ray = novel_.RayFromPixel({x + 0.5, y + 0.5});
    const double squared = ray.squaredNorm(), scale = novel_.fx_px() * w;
    double least = 1;  // squared
    for (const Eigen::Vector3d& centre : view_centres_) {
      const double dot = ray.dot(centre), along = squared - w * dot;
      const double across =
          scale * scale * std::max(squared * centre.squaredNorm() - dot * dot, 0.0);
      if (along > 0 && across < least * along * along) least = across / (along * along);
    }
    return std::sqrt(least);
  }

  void Smooth(int x, int y, float strength) {
    const bool inside = x > 0 && y > 0 && x + 1 < width_ && y + 1 < height_;
    const std::array<float, 3> mean = inside && holes_are_filled_ ? WholeMean(x, y) : Mean(x, y);
    for (size_t c = 0; c < 3; ++c) {
      std::uint8_t& value = result_.image(x, y, static_cast<int>(c));
      value = Srgb8FromLinear((1 - strength) * linear_[value] + strength * mean[c]);
    }
  }

  /// SPEC 8.2, of the pixels around that are there.
  std::array<float, 3> Mean(int x, int y) const {
    std::array<float, 3> mean{};
    float total = 0;
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v) {
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u) {
        if (!IsShown(u, v)) continue;
        const float weight = (u == x ? kMiddleWeight : 1) * (v == y ? kMiddleWeight : 1);
        const std::uint8_t* const rgb = &plain_(u, v);
        total += weight;
        for (size_t c = 0; c < 3; ++c) mean[c] += weight * linear_[rgb[c]];
      }
    }
    for (float& channel : mean) channel /= total;
    return mean;
  }

  /// The same where all nine are there.
  std::array<float, 3> WholeMean(int x, int y) const {
    constexpr float kShare = 1 / ((kMiddleWeight + 2) * (kMiddleWeight + 2));
    const auto row = [&](int v, size_t c) {
      const std::uint8_t* const left = &plain_(x - 1, v);
      return linear_[left[c]] + kMiddleWeight * linear_[left[3 + c]] + linear_[left[6 + c]];
    };
    std::array<float, 3> mean;
    for (size_t c = 0; c < 3; ++c) {
      mean[c] = kShare * (row(y - 1, c) + kMiddleWeight * row(y, c) + row(y + 1, c));
    }
    return mean;
  }

  const PinholeCamera& novel_;
  const std::span<const Eigen::Vector3d> view_centres_;
  const bool holes_are_filled_;
  const int width_, height_;
  const std::array<float, 256> linear_;
  const ImageRgb8 plain_;  ///< as it was: smoothed pixels are no source of others
  RenderResult& result_;
};

}  // namespace

void SmoothEdges(const PinholeCamera& novel, std::span<const Eigen::Vector3d> view_centres,
                 bool holes_are_filled, RenderResult& result) {
  EdgeSmoother smoother(novel, view_centres, holes_are_filled, result);
  const int height = result.image.height(), pieces = (height + kRowsTogether - 1) / kRowsTogether;
  ParallelFor(0, pieces, [&](int piece) {
    const int first = piece * kRowsTogether;
    smoother.SmoothRows(first, std::min(first + kRowsTogether, height));
  });
}

}  // namespace dtr
