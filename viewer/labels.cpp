#include "viewer/labels.h"

#include <algorithm>
#include <numeric>

namespace dtr::viewer {

std::vector<size_t> LegibleNames(std::span<const PlacedName> names) {
  std::vector<size_t> order(names.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return names[a].distance < names[b].distance; });
  const auto overlap = [](const Eigen::AlignedBox2d& a, const Eigen::AlignedBox2d& b) {
    return (a.min().array() < b.max().array()).all() && (b.min().array() < a.max().array()).all();
  };
  std::vector<size_t> legible;
  for (const size_t name : order) {
    const bool free = std::none_of(legible.begin(), legible.end(), [&](size_t other) {
      return overlap(names[name].box, names[other].box);
    });
    if (free) legible.push_back(name);
  }
  return legible;
}

}  // namespace dtr::viewer
