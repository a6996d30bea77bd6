#include "stereo/complete/expand.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"

namespace dtr::stereo {
namespace {

constexpr float kAlike = 10;       // levels of sRGB between a pixel and a cell, for 1/e of its say
constexpr float kSameDepthPx = 1;  // cells of disparity: the same surface

/// The planes of the cells around a pixel at its ray, and their say.
struct Votes {
  std::array<float, 9> weight{}, inverse_depth{};
  size_t count = 0;

  void Add(float w, float say) {
    inverse_depth[count] = std::max(0.0F, w);
    weight[count++] = say;
  }
  /// Of those that lie on one surface, the mean of most say.
  float Best(float same) const {
    float most = 0, best = 0;
    for (size_t a = 0; a < count; ++a) {
      float sum = 0, mean = 0;
      for (size_t b = 0; b < count; ++b) {
        if (std::abs(inverse_depth[a] - inverse_depth[b]) > same) continue;
        sum += weight[b];
        mean += weight[b] * inverse_depth[b];
      }
      if (sum > most) most = sum, best = mean / sum;
    }
    return best;
  }
};

class Expansion {
 public:
  Expansion(const View& view, const CellView& cells, const CompletedCells& completed)
      : view_(view), cells_(cells), completed_(completed) {
    for (int c = 0; c < 3; ++c) {
      for (int level = 0; level < 256; ++level) {
        levels_[static_cast<size_t>(c)][static_cast<size_t>(level)] = static_cast<float>(
            255 * SrgbFromLinear(Exposed(LinearFromSrgb(level / 255.0), view.gain[c])));
      }
    }
  }

  /// Inverse depth at a pixel of the photo.
  float At(int x, int y) const {
    const auto size = static_cast<float>(cells_.cell_px);
    const float u = (static_cast<float>(x) + 0.5F) / size;
    const float v = (static_cast<float>(y) + 0.5F) / size;
    const int column = x / cells_.cell_px, row = y / cells_.cell_px;
    const Eigen::Vector3f ray = cells_.RayAt(u, v);
    Votes votes;
    for (int j = row - 1; j <= row + 1; ++j) {
      for (int i = column - 1; i <= column + 1; ++i) {
        if (!cells_.usable.Contains(i, j) || cells_.usable(i, j) == 0) {
          continue;
        }
        const float du = u - static_cast<float>(i) - 0.5F, dv = v - static_cast<float>(j) - 0.5F;
        votes.Add(completed_.PlaneAt(i, j).dot(ray),
                  std::exp(-(du * du + dv * dv) - Difference(x, y, i, j) / kAlike));
      }
    }
    return votes.Best(kSameDepthPx * cells_.pixel);
  }

 private:
  /// Of a pixel's colour from that of a cell, levels.
  float Difference(int x, int y, int column, int row) const {
    float off = 0;
    for (int c = 0; c < 3; ++c) {
      off += std::abs(levels_[static_cast<size_t>(c)][view_.image(x, y, c)] -
                      cells_.colour(column, row, c));
    }
    return off / 3;
  }

  const View& view_;
  const CellView& cells_;
  const CompletedCells& completed_;
  std::array<std::array<float, 256>, 3> levels_{};  ///< of the photo, in the set's exposure
};

}  // namespace

DepthImage ExpandCells(const View& view, const CellView& cells, const CompletedCells& completed,
                       float far_z) {
  const Expansion expansion(view, cells, completed);
  DepthImage depth(view.depth.width(), view.depth.height());
  const int scale = view.depth_scale;
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (!DepthImage::IsHole(view.depth(x, y))) continue;
      const int px = x * scale + scale / 2, py = y * scale + scale / 2;
      if (!view.mask.empty() && view.mask(px, py) == 0) continue;
      const float w = expansion.At(px, py);
      depth(x, y) = w * far_z > 1 ? 1 / w : far_z;
    }
  }
  return depth;
}

}  // namespace dtr::stereo
