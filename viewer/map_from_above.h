// viewer/map_from_above.h -- a set seen from above: cameras, and how many views cover each place.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "dtr/types/dtr_set.h"
#include "dtr/types/grid.h"

namespace dtr::viewer {

/// A window on the ground plane. The plane's axes are `right` and `down` (world, unit length,
/// level); down is the mean direction in which the cameras look, turned: cameras stand below what
/// they see. Where cameras look at right angles at the plane in which they stand, as from the air,
/// that plane is level; down is then what is at the bottom of their images.
struct Ground {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX(), down = Eigen::Vector3d::UnitY();
  Eigen::Vector2d min = Eigen::Vector2d::Zero(), max = Eigen::Vector2d::Ones();  ///< scene units

  Eigen::Vector2d Place(const Eigen::Vector3d& p_in_world) const {
    return {right.dot(p_in_world), down.dot(p_in_world)};
  }
};

/// A window that holds the scene's bounds and all source cameras of the first frame.
Ground GroundOf(const DtrSet& set);

/// Counts, cell by cell of a grid over the ground, the views whose depth has a point there.
class CoverageFromAbove {
 public:
  /// `side_px`: cells along the longer side.
  CoverageFromAbove(const Ground& ground, int side_px);
  /// Adds a view that has its depth loaded.
  void Add(const View& view);
  /// Views per cell.
  const Grid<std::uint16_t>& counts() const { return counts_; }
  /// Brighter: more views; green: none. Up to `views` views.
  ImageRgb8 Picture(int views) const;

 private:
  Ground ground_;
  Grid<std::uint16_t> counts_;
};

/// An SVG document: source cameras as wedges as wide as their fields of view, with their names;
/// `colour_of` gives a CSS colour.
std::string CameraMapSvg(const DtrSet& set, const Ground& ground,
                         const std::function<std::string(const View&)>& colour_of);

}  // namespace dtr::viewer
