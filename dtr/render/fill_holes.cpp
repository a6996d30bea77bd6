#include "dtr/render/fill_holes.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "dtr/render/colour.h"

namespace dtr {
namespace {

// A cell counts (farthest / own inverse depth)^4: a quarter nearer halves its say, twice as near
// leaves a sixteenth, at any scale; a hard limit would draw the blocks of the pyramid into slanted
// ground.
constexpr double kBackgroundPower = 4;

/// A cell of the pyramid: colour (linear), inverse depth and how much of it is known.
struct Cell {
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  double inverse_depth = 0;
  double weight = 0;
};
using Level = Grid<Cell>;

/// Weighted mean of the background among some cells; weight 0 when none is known. `taps` are the
/// interpolation weights.
template <size_t N>
Cell BackgroundMean(const std::array<const Cell*, N>& cells, const std::array<double, N>& taps) {
  double farthest = 0;
  bool any = false;
  for (size_t i = 0; i < N; ++i) {
    if (cells[i] == nullptr || !(cells[i]->weight > 0) || !(taps[i] > 0)) continue;
    farthest = any ? std::min(farthest, cells[i]->inverse_depth) : cells[i]->inverse_depth;
    any = true;
  }
  Cell mean;
  if (!any) return mean;
  for (size_t i = 0; i < N; ++i) {
    if (cells[i] == nullptr || !(cells[i]->weight > 0)) continue;
    const double nearness = std::pow(farthest / cells[i]->inverse_depth, kBackgroundPower);
    const double weight = cells[i]->weight * taps[i] * nearness;
    mean.colour += weight * cells[i]->colour;
    mean.inverse_depth += weight * cells[i]->inverse_depth;
    mean.weight += weight;
  }
  if (!(mean.weight > 0)) return Cell{};
  mean.colour /= mean.weight;
  mean.inverse_depth /= mean.weight;
  return mean;
}

const Cell* CellAt(const Level& level, int x, int y) {
  return level.Contains(x, y) ? &level(x, y) : nullptr;
}

Level FinestLevel(const RenderResult& result) {
  Level level(result.image.width(), result.image.height());
  const std::array<double, 256>& linear = LinearFromSrgb8();
  for (int y = 0; y < level.height(); ++y) {
    for (int x = 0; x < level.width(); ++x) {
      if (result.coverage(x, y) == 0 || DepthImage::IsHole(result.depth(x, y))) continue;
      const std::uint8_t* rgb = &result.image(x, y);
      level(x, y) = {{linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]},
                     1.0 / static_cast<double>(result.depth(x, y)),
                     1.0};
    }
  }
  return level;
}

/// Pull: each coarse cell is the background of its four children.
Level Coarser(const Level& fine) {
  Level coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2);
  for (int y = 0; y < coarse.height(); ++y) {
    for (int x = 0; x < coarse.width(); ++x) {
      const std::array<const Cell*, 4> children = {
          CellAt(fine, 2 * x, 2 * y), CellAt(fine, 2 * x + 1, 2 * y),
          CellAt(fine, 2 * x, 2 * y + 1), CellAt(fine, 2 * x + 1, 2 * y + 1)};
      Cell cell = BackgroundMean<4>(children, {1, 1, 1, 1});
      cell.weight = std::min(cell.weight, 1.0);
      coarse(x, y) = cell;
    }
  }
  return coarse;
}

/// Push: unknown fine cells take the bilinear background of the four coarse cells around them.
void FillFrom(const Level& coarse, Level& fine) {
  for (int y = 0; y < fine.height(); ++y) {
    for (int x = 0; x < fine.width(); ++x) {
      if (fine(x, y).weight > 0) continue;
      const double cx = 0.5 * (x + 0.5) - 0.5, cy = 0.5 * (y + 0.5) - 0.5;
      const int x0 = static_cast<int>(std::floor(cx)), y0 = static_cast<int>(std::floor(cy));
      const double fx = cx - x0, fy = cy - y0;
      Cell cell = BackgroundMean<4>({CellAt(coarse, x0, y0), CellAt(coarse, x0 + 1, y0),
                                     CellAt(coarse, x0, y0 + 1), CellAt(coarse, x0 + 1, y0 + 1)},
                                    {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy});
      if (cell.weight > 0) cell.weight = 1;
      fine(x, y) = cell;
    }
  }
}

}  // namespace

void FillHoles(RenderResult& result) {
  const auto& covered = result.coverage.data();
  if (std::count(covered.begin(), covered.end(), 0) == 0) return;
  std::vector<Level> pyramid = {FinestLevel(result)};
  while (pyramid.back().width() > 1 || pyramid.back().height() > 1) {
    pyramid.push_back(Coarser(pyramid.back()));
  }
  for (size_t level = pyramid.size() - 1; level > 0; --level) {
    FillFrom(pyramid[level], pyramid[level - 1]);
  }
  for (int y = 0; y < result.image.height(); ++y) {
    for (int x = 0; x < result.image.width(); ++x) {
      if (result.coverage(x, y) != 0) continue;
      for (int channel = 0; channel < 3; ++channel) {
        result.image(x, y, channel) = Srgb8FromLinear(pyramid[0](x, y).colour[channel]);
      }
    }
  }
}

}  // namespace dtr
