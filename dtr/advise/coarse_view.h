// dtr/advise/coarse_view.h -- views as small as questions of coverage need them.
#pragma once
#include <string>
#include <vector>

#include "dtr/types/view.h"

namespace dtr::advise {

/// A view on a coarse grid: where it stands, and some depths of its map, not averaged.
struct CoarseView {
  std::string name;
  PinholeCamera camera{1, 1, 1, 1, 0, 0};  ///< of the coarse grid
  Pose cam_from_world;
  DepthImage depth;          ///< plane z; holes where the map has none
  double pixel_of_fine = 1;  ///< pixels of the view's image per pixel of the coarse grid

  Eigen::Vector3d CenterInWorld() const { return cam_from_world.TargetOriginInSource(); }
};

/// The view, whose depth must be loaded, with at most `side_px` samples along its long side.
CoarseView MakeCoarse(const View& view, int side_px);

/// What a view knows of a point.
enum class Visibility {
  kOutside,  ///< beyond its image, or behind it
  kHidden,   ///< something of it stands before the point
  kNothing,  ///< it looks there, but has no depth
  kSeen,     ///< its surface is there
  kBeyond,   ///< its surface is further away: it looks through the point
};

/// Tolerance of VisibilityOf between coarse samples of one surface.
inline constexpr double kOneSurface = 0.03;

/// `tolerance`: difference of inverse depths, relative, up to which two are of one surface; the
/// nearest of the 3x3 samples about the point's pixel counts, as coarse slopes demand.
Visibility VisibilityOf(const CoarseView& view, const Eigen::Vector3d& p_in_world,
                        double tolerance);

}  // namespace dtr::advise
