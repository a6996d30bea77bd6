#include "dtr/render/push_pull.h"

#include <algorithm>

namespace dtr {
namespace {

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

}  // namespace dtr
