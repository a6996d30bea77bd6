#include "dtr/render/push_pull.h"

#include <algorithm>

#include "dtr/base/parallel_for.h"

namespace dtr {
namespace {

using Cell = PushPull::Cell;
using Level = Grid<Cell>;

// Smaller levels are done before another thread would have started.
constexpr int kRowsWorthThreads = 64;

template <typename Row>
void ForRows(const Level& level, const Row& row) {
  ParallelFor(0, level.height(), level.height() < kRowsWorthThreads ? 1 : level.height(), row);
}

/// Sums the cells that are known.
class Mean {
 public:
  void Add(const Cell& cell, double share) {
    const double weight = cell.weight * share;
    sum_.weight += weight;
    for (size_t v = 0; v < sum_.values.size(); ++v) sum_.values[v] += weight * cell.values[v];
  }
  Cell Get() const {
    if (!(sum_.weight > 0)) return {};
    Cell mean = sum_;
    for (double& value : mean.values) value /= sum_.weight;
    mean.weight = std::min(sum_.weight, 1.0);
    return mean;
  }

 private:
  Cell sum_;
};

/// Pull: each needed coarse cell is the mean of its up to four children.
template <typename Finer>
Level Coarser(const Mask& needed, int width, int height, const Finer& finer) {
  Level coarse(needed.width(), needed.height());
  ForRows(coarse, [&](int y) {
    for (int x = 0; x < coarse.width(); ++x) {
      if (needed(x, y) == 0) continue;
      Mean mean;
      for (int cy = 2 * y; cy < std::min(2 * y + 2, height); ++cy) {
        for (int cx = 2 * x; cx < std::min(2 * x + 2, width); ++cx) mean.Add(finer(cx, cy), 1);
      }
      coarse(x, y) = mean.Get();
    }
  });
  return coarse;
}

/// Push: the bilinear mean of the four coarse cells around a fine one.
Cell Between(const Level& coarse, int x, int y) {
  // A fine cell's centre lies a quarter of a coarse cell beside the coarse centre.
  const int x0 = (x + 1) / 2 - 1, y0 = (y + 1) / 2 - 1;
  const double fx = x % 2 == 0 ? 0.75 : 0.25, fy = y % 2 == 0 ? 0.75 : 0.25;
  Mean mean;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      if (!coarse.Contains(x0 + i, y0 + j)) continue;
      mean.Add(coarse(x0 + i, y0 + j), (i == 0 ? 1 - fx : fx) * (j == 0 ? 1 - fy : fy));
    }
  }
  Cell between = mean.Get();
  if (between.weight > 0) between.weight = 1;
  return between;
}

/// Half the size, rounded up; each cell combines its up to four children. `combine` must not mind
/// one that is given twice. Loops that a compiler turns into vectors.
template <typename Combine>
Mask Halved(const Mask& fine, const Combine& combine) {
  Mask coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2);
  const int pairs = fine.width() / 2;
  std::vector<std::uint8_t> both(static_cast<size_t>(fine.width()));
  for (int y = 0; y < coarse.height(); ++y) {
    const std::uint8_t* upper = fine.row(2 * y);
    const std::uint8_t* lower = fine.row(std::min(2 * y + 1, fine.height() - 1));
    std::uint8_t *column = both.data(), *to = coarse.row(y);
    for (int x = 0; x < fine.width(); ++x) column[x] = combine(upper[x], lower[x]);
    for (int x = 0; x < pairs; ++x) to[x] = combine(column[2 * x], column[2 * x + 1]);
    if (fine.width() % 2 != 0) to[pairs] = column[2 * pairs];
  }
  return coarse;
}

/// Marks the children of every marked cell too.
void MarkChildren(const Mask& coarse, Mask& fine) {
  const int pairs = fine.width() / 2;
  for (int y = 0; y < fine.height(); ++y) {
    const std::uint8_t* from = coarse.row(y / 2);
    std::uint8_t* to = fine.row(y);
    for (int x = 0; x < pairs; ++x) to[2 * x] |= from[x], to[2 * x + 1] |= from[x];
    if (fine.width() % 2 != 0) to[2 * pairs] |= from[pairs];
  }
}

/// Not 0 where any of the 3x3 cells around is not 0.
Mask WithNeighbours(const Mask& mask) {
  const int width = mask.width(), height = mask.height();
  Mask rows(width, height), grown(width, height);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* from = mask.row(y);
    std::uint8_t* to = rows.row(y);
    for (int x = 0; x < width; ++x) to[x] = from[x];
    for (int x = 1; x < width; ++x) to[x] |= from[x - 1];
    for (int x = 1; x < width; ++x) to[x - 1] |= from[x];
  }
  for (int y = 0; y < height; ++y) {
    std::uint8_t* to = grown.row(y);
    for (int j = std::max(0, y - 1); j <= std::min(height - 1, y + 1); ++j) {
      const std::uint8_t* from = rows.row(j);
      for (int x = 0; x < width; ++x) to[x] |= from[x];
    }
  }
  return grown;
}

}  // namespace

HolePyramid::HolePyramid(const Mask& hole) : width_(hole.width()), height_(hole.height()) {
  const auto either = [](int a, int b) { return static_cast<std::uint8_t>(a | b); };
  const auto both = [](int a, int b) { return static_cast<std::uint8_t>(a & b); };
  constexpr std::uint8_t kUnknown = 255;
  Mask unknown = hole;
  while (unknown.width() > 1 || unknown.height() > 1) {
    const Mask asking = Halved(unknown, either);
    if (std::find(asking.data().begin(), asking.data().end(), kUnknown) == asking.data().end())
      break;
    // A fine cell draws on the coarse cells around it; those must know their own children first.
    needed_.push_back(WithNeighbours(asking));
    unknown = Halved(unknown, both);
  }
  for (size_t level = needed_.size(); level-- > 1;) {
    MarkChildren(needed_[level], needed_[level - 1]);
  }
}

PushPull::PushPull(const HolePyramid& holes, const std::function<Cell(int x, int y)>& finest) {
  int width = holes.width(), height = holes.height();
  for (const Mask& needed : holes.needed()) {
    if (levels_.empty()) {
      levels_.push_back(Coarser(needed, width, height, finest));
    } else {
      const Level& fine = levels_.back();
      levels_.push_back(Coarser(needed, width, height, [&](int x, int y) { return fine(x, y); }));
    }
    width = needed.width(), height = needed.height();
  }
  for (size_t level = levels_.size(); level-- > 1;) {
    const Level& coarse = levels_[level];
    const Mask& needed = holes.needed()[level - 1];
    Level& fine = levels_[level - 1];
    ForRows(fine, [&](int y) {
      for (int x = 0; x < fine.width(); ++x) {
        if (needed(x, y) != 0 && !(fine(x, y).weight > 0)) fine(x, y) = Between(coarse, x, y);
      }
    });
  }
}

PushPull::Cell PushPull::At(int x, int y) const {
  return levels_.empty() ? Cell{} : Between(levels_.front(), x, y);
}

}  // namespace dtr
