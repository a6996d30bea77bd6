// dtr/render/free_space.h -- where a camera may stand, by cameras and depth maps.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "dtr/types/view.h"

namespace dtr {

/// Reads depth, completed depth too, into a view that is described; leaves it empty where it
/// cannot.
using DepthLoader = std::function<void(View&)>;

/// Positions are free that are near a camera or before the surface which views see there. What no
/// view sees counts as free, too: photographers rarely see where they stand.
class FreeSpace {
 public:
  /// `near` is the distance to a camera below which a position is free. Takes the depth of at most
  /// 64 of the views, at even steps; `load` reads those that are not in memory.
  FreeSpace(std::span<const View* const> views, double near, const DepthLoader& load);

  /// Whether the position is free: before a surface by a fifth of its depth at least.
  bool Has(const Eigen::Vector3d& position_in_world) const;
  /// Whether all positions of the straight line between two are.
  bool HasLine(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
  /// Median depth of what the view nearest to the position sees, scene units; 0: no depth is known.
  double SceneZ(const Eigen::Vector3d& position_in_world) const;

 private:
  /// A view's surfaces at every kStep-th pixel; infinitely far ones have an infinite depth.
  struct Surfaces {
    PinholeCamera camera;
    Pose cam_from_world;
    Grid<float> z;
    double median_z;
  };
  static Surfaces SurfacesOf(const View& view);

  std::vector<Eigen::Vector3d> centers_;
  std::vector<Surfaces> seen_;
  double near_;
};

}  // namespace dtr
