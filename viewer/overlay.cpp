#include "viewer/overlay.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace dtr::viewer {
namespace {

constexpr double kMaxOfDisplay = 0.25;

}  // namespace

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

bool MayBeLaidOver(const std::array<Eigen::Vector2d, 4>& corners,
                   const Eigen::Vector2d& display_px) {
  double twice_area = 0;  // shoelace formula
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % 4];
    twice_area += a.x() * b.y() - b.x() * a.y();
  }
  return std::abs(twice_area) <= 2 * kMaxOfDisplay * display_px.prod();
}

}  // namespace dtr::viewer
