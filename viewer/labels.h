// viewer/labels.h -- which names are written over a picture.
#pragma once
#include <Eigen/Geometry>
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

}  // namespace dtr::viewer
