#include "dtr/render/push_pull.h"

namespace dtr {
namespace {

/// Half the size, rounded up; each cell combines its up to four children.
template <typename Combine>
Mask Halved(const Mask& fine, std::uint8_t initial, const Combine& combine) {
  Mask coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2, 1, initial);
  for (int y = 0; y < fine.height(); ++y) {
    const std::uint8_t* from = fine.row(y);
    std::uint8_t* to = coarse.row(y / 2);
    for (int x = 0; x < fine.width(); ++x) to[x / 2] = combine(to[x / 2], from[x]);
  }
  return coarse;
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
    const Mask asking = Halved(unknown, 0, either);
    if (std::find(asking.data().begin(), asking.data().end(), kUnknown) == asking.data().end())
      break;
    // A fine cell draws on the coarse cells around it; those must know their own children first.
    needed_.push_back(WithNeighbours(asking));
    unknown = Halved(unknown, kUnknown, both);
  }
  for (size_t level = needed_.size(); level-- > 1;) {
    const Mask& coarse = needed_[level];
    Mask& fine = needed_[level - 1];
    for (int y = 0; y < fine.height(); ++y) {
      for (int x = 0; x < fine.width(); ++x) fine(x, y) |= coarse(x / 2, y / 2);
    }
  }
}

}  // namespace dtr
