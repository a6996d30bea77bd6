// viewer/overlay.h -- what may lie over an image: names that can be read, photos that hide little.
#pragma once
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

namespace dtr::viewer {

/// A name that may be written.
struct PlacedName {
  double distance;          ///< from where one looks to what it names
  Eigen::AlignedBox2d box;  ///< what it would cover, display pixels
};

/// Indices of the nearest names and, of the others, those that would not lie on one of them,
/// nearest first: many in one place would not be legible, any of them. Of equally near ones the
/// first comes first; boxes that only touch do not lie on each other.
std::vector<size_t> LegibleNames(std::span<const PlacedName> names);

/// Whether a photo may be laid between these corners (in order, display pixels): it covers a
/// quarter of the display at most. That of the camera one stands at would hide what is drawn from
/// it.
bool MayBeLaidOver(const std::array<Eigen::Vector2d, 4>& corners,
                   const Eigen::Vector2d& display_px);

}  // namespace dtr::viewer
