// dtr/render/push_pull.h -- SPEC 7.1: what a hole takes from its surroundings, at every scale.
#pragma once
#include <algorithm>
#include <array>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "dtr/types/grid.h"

namespace dtr {

/// Which of the cells around a hole have the most say.
enum class Favour {
  kFar,   ///< the farthest: the fourth power of the ratio of inverse depths
  kNone,  ///< all alike
};

/// Which cells of each coarser level the holes of an image draw on; the others are never made, so
/// that an image with few holes costs little more than looking for them. Level l has cells of 2^l
/// pixels; level 0, the image itself, is not stored.
class HolePyramid {
 public:
  /// `hole` is not 0 where a pixel is unknown.
  explicit HolePyramid(const Mask& hole);
  int width() const { return width_; }
  int height() const { return height_; }
  /// needed()[l - 1] is not 0 for the needed cells of level l. It ends with the first level without
  /// an unknown cell, or with a level of a single one.
  const std::vector<Mask>& needed() const { return needed_; }

 private:
  int width_, height_;
  std::vector<Mask> needed_;
};

/// Push-pull (Gortler et al., The Lumigraph, SIGGRAPH 1996, sec. 3.5) of `kValues` numbers and an
/// inverse depth per pixel. Made once for an image; then At() answers for any hole. Does not
/// depend on the number of threads.
template <size_t kValues>
class PushPull {
 public:
  struct Cell {
    double inverse_depth = 0;
    double weight = 0;  ///< how much of the cell is known, at most 1; 0: nothing, no other value
    std::array<double, kValues> values{};
  };

  /// `finest(x, y)` is the Cell of a pixel: weight 1 where it is known, else 0.
  template <typename Finest>
  PushPull(const HolePyramid& holes, Favour favour, int threads, const Finest& finest);

  /// What a hole takes; weight 0 when the image has no known pixel.
  Cell At(int x, int y) const { return levels_.empty() ? Cell{} : Between(levels_.front(), x, y); }

 private:
  using Level = Grid<Cell>;
  // Smaller levels are done before another thread would have started.
  static constexpr int kRowsWorthThreads = 64;

  Cell Mean(const std::array<const Cell*, 4>& cells, const std::array<double, 4>& taps) const;
  Cell Between(const Level& coarse, int x, int y) const;
  template <typename Finer>
  Level Coarser(const Mask& needed, int width, int height, int threads, const Finer& finer) const;

  Favour favour_;
  std::vector<Level> levels_;  ///< level 1 first
};

/// Weighted mean, most of the favoured cells; weight 0 when none is known. A cell twice as near as
/// the farthest keeps a sixteenth of its say, at any scale; a hard limit would draw the blocks of
/// the pyramid into slanted ground.
template <size_t kValues>
typename PushPull<kValues>::Cell PushPull<kValues>::Mean(const std::array<const Cell*, 4>& cells,
                                                         const std::array<double, 4>& taps) const {
  double farthest = 0;
  bool any = false;
  for (const Cell* cell : cells) {
    if (cell == nullptr || !(cell->weight > 0)) continue;
    farthest = any ? std::min(farthest, cell->inverse_depth) : cell->inverse_depth;
    any = true;
  }
  Cell mean;
  if (!any) return mean;
  for (size_t i = 0; i < cells.size(); ++i) {
    const Cell* cell = cells[i];
    if (cell == nullptr || !(cell->weight > 0)) continue;
    double weight = cell->weight * taps[i];
    if (favour_ == Favour::kFar) {
      const double ratio = farthest / cell->inverse_depth, square = ratio * ratio;
      weight *= square * square;
    }
    for (size_t v = 0; v < kValues; ++v) mean.values[v] += weight * cell->values[v];
    mean.inverse_depth += weight * cell->inverse_depth;
    mean.weight += weight;
  }
  if (!(mean.weight > 0)) return Cell{};
  const double one_over_weight = 1 / mean.weight;
  for (double& value : mean.values) value *= one_over_weight;
  mean.inverse_depth *= one_over_weight;
  mean.weight = std::min(mean.weight, 1.0);
  return mean;
}

/// Pull: each coarse cell is the favoured mean of its four children.
template <size_t kValues>
template <typename Finer>
typename PushPull<kValues>::Level PushPull<kValues>::Coarser(const Mask& needed, int width,
                                                             int height, int threads,
                                                             const Finer& finer) const {
  Level coarse((width + 1) / 2, (height + 1) / 2);
  ParallelFor(0, coarse.height(), coarse.height() < kRowsWorthThreads ? 1 : threads, [&](int y) {
    for (int x = 0; x < coarse.width(); ++x) {
      if (needed(x, y) == 0) continue;
      std::array<Cell, 4> children;
      std::array<const Cell*, 4> inside{};
      for (int c = 0; c < 4; ++c) {
        const int cx = 2 * x + c % 2, cy = 2 * y + c / 2;
        if (cx >= width || cy >= height) continue;
        const auto i = static_cast<size_t>(c);
        children[i] = finer(cx, cy);
        inside[i] = &children[i];
      }
      coarse(x, y) = Mean(inside, {1, 1, 1, 1});
    }
  });
  return coarse;
}

/// Push: the bilinear favoured mean of the four coarse cells around a fine one.
template <size_t kValues>
typename PushPull<kValues>::Cell PushPull<kValues>::Between(const Level& coarse, int x,
                                                            int y) const {
  // A fine cell's centre lies a quarter of a coarse cell beside the coarse centre.
  const int x0 = (x + 1) / 2 - 1, y0 = (y + 1) / 2 - 1;
  const double fx = x % 2 == 0 ? 0.75 : 0.25, fy = y % 2 == 0 ? 0.75 : 0.25;
  const auto cell = [&](int cx, int cy) {
    return coarse.Contains(cx, cy) ? &coarse(cx, cy) : nullptr;
  };
  Cell mean = Mean({cell(x0, y0), cell(x0 + 1, y0), cell(x0, y0 + 1), cell(x0 + 1, y0 + 1)},
                   {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy});
  if (mean.weight > 0) mean.weight = 1;
  return mean;
}

template <size_t kValues>
template <typename Finest>
PushPull<kValues>::PushPull(const HolePyramid& holes, Favour favour, int threads,
                            const Finest& finest)
    : favour_(favour) {
  const std::vector<Mask>& needed = holes.needed();
  if (needed.empty()) return;
  levels_.reserve(needed.size());
  levels_.push_back(Coarser(needed[0], holes.width(), holes.height(), threads, finest));
  for (size_t level = 1; level < needed.size(); ++level) {
    const Level& fine = levels_.back();
    levels_.push_back(Coarser(needed[level], fine.width(), fine.height(), threads,
                              [&fine](int x, int y) { return fine(x, y); }));
  }
  for (size_t level = levels_.size() - 1; level > 0; --level) {
    const Level& coarse = levels_[level];
    const Mask& fine_needed = needed[level - 1];
    Level& fine = levels_[level - 1];
    ParallelFor(0, fine.height(), fine.height() < kRowsWorthThreads ? 1 : threads, [&](int y) {
      for (int x = 0; x < fine.width(); ++x) {
        if (fine_needed(x, y) == 0 || fine(x, y).weight > 0) continue;
        fine(x, y) = Between(coarse, x, y);
      }
    });
  }
}

}  // namespace dtr
