// dtr/render/grid_placement.h -- a view's grid of samples on the novel screen, and which of its
// tiles can be seen there.
#pragma once
#include <Eigen/Core>

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/frame.h"

namespace dtr {

/// The surface point at (x, y), in half samples, with inverse depth w lies on the novel screen at
/// from_grid (x, y, 1) + from_centre w, homogeneous: x and y in pixels, times z; z times w in the
/// novel frame.
struct GridPlacement {
  Eigen::Matrix3d from_grid = Eigen::Matrix3d::Identity();
  Eigen::Vector3d from_centre = Eigen::Vector3d::Zero();
  double near_z = 0;  ///< scene units
};
GridPlacement PlaceGrid(const View& view, const AdaptiveMesh& layout, const ViewPlacement& placed,
                        const PinholeCamera& novel);

/// The largest half side of a sample's square, pixels (SPEC 3.2; as in coarse_cells.comp).
inline constexpr double kLargestHalfCellPx = 32;

/// False only where nothing of the tile reaches the band's pixels: it lies beside them or behind
/// the near plane, or shows its back with everything it holds (SPEC 2.4).
bool MayBeSeen(const AdaptiveMesh::Tile& tile, const GridPlacement& placement, int width_px,
               const Band& band);

/// About how many rows of the screen the tile's largest possible triangle takes; infinity where the
/// tile crosses the near plane.
double RowsOfTriangles(const AdaptiveMesh::Tile& tile, const GridPlacement& placement);

}  // namespace dtr
