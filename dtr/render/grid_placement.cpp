#include "dtr/render/grid_placement.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace dtr {
namespace {

using Range = AdaptiveMesh::Range;

// Triangles this near to showing their edge (1: seen as the view itself sees them) count as seen:
// single precision may turn them either way.
constexpr double kEdgeOn = 1e-3;

/// The largest value of a b, a and b anywhere in their ranges.
double LargestProduct(const Range& a, double b_low, double b_high) {
  return std::max({a.low * b_low, a.low * b_high, a.high * b_low, a.high * b_high});
}

/// All triangles and cells turn their back to the novel camera. A surface with slopes g of 1/z has
/// the determinant of its map to the screen, over that of from_grid, at
/// 1 + gx (d.x - x d.z) + gy (d.y - y d.z) + w d.z with d = from_grid^-1 from_centre.
bool ShowsBack(const AdaptiveMesh::Tile& tile, const GridPlacement& placement) {
  const Eigen::Vector3d d = placement.from_grid.inverse() * placement.from_centre;
  const auto term = [&](const Range& slope_per_sample, double along, const Range& position) {
    const double at_low = along - position.low * d.z(), at_high = along - position.high * d.z();
    return 0.5 * LargestProduct(slope_per_sample, at_low, at_high);
  };
  const double largest = 1 + term(tile.slope_x, d.x(), tile.x) + term(tile.slope_y, d.y(), tile.y) +
                         LargestProduct(tile.inverse_depth, d.z(), d.z());
  return largest < -kEdgeOn;
}

/// Corner 0 to 7 of a tile's box, on the screen times z, and its inverse depth in the view.
struct Corner {
  Eigen::Vector3d p;
  double w = 0;
};
Corner CornerOf(const AdaptiveMesh::Tile& tile, const GridPlacement& placement, int corner) {
  const double w = corner & 4 ? tile.inverse_depth.high : tile.inverse_depth.low;
  const Eigen::Vector3d at(corner & 1 ? tile.x.high : tile.x.low,
                           corner & 2 ? tile.y.high : tile.y.low, 1);
  return {placement.from_grid * at + placement.from_centre * w, w};
}

}  // namespace

GridPlacement PlaceGrid(const View& view, const AdaptiveMesh& layout, const ViewPlacement& placed,
                        const PinholeCamera& novel) {
  const PinholeCamera camera = view.DepthCamera();
  const double origin = layout.DepthPixel(0), scale = layout.DepthPixel(1) - origin;
  Eigen::Matrix3d ray_from_grid, novel_matrix;
  ray_from_grid << scale / camera.fx_px(), 0, (origin - camera.cx_px()) / camera.fx_px(),  //
      0, scale / camera.fy_px(), (origin - camera.cy_px()) / camera.fy_px(),               //
      0, 0, 1;
  novel_matrix << novel.fx_px(), 0, novel.cx_px(), 0, novel.fy_px(), novel.cy_px(), 0, 0, 1;
  return {novel_matrix * placed.rotation * ray_from_grid, novel_matrix * placed.translation,
          placed.near_z};
}

bool MayBeSeen(const AdaptiveMesh::Tile& tile, const GridPlacement& placement, int width_px,
               const Band& band) {
  // Everything lies between the corners of a box in which the conditions are linear.
  const double left = -kLargestHalfCellPx, right = width_px + kLargestHalfCellPx;
  const double top = band.first - kLargestHalfCellPx;
  const double bottom = band.first + band.count + kLargestHalfCellPx;
  bool all_left = true, all_right = true, all_above = true, all_below = true, all_behind = true;
  for (int corner = 0; corner < 8; ++corner) {
    const auto [p, w] = CornerOf(tile, placement, corner);
    all_left = all_left && p.x() < left * p.z();
    all_right = all_right && p.x() > right * p.z();
    all_above = all_above && p.y() < top * p.z();
    all_below = all_below && p.y() > bottom * p.z();
    all_behind = all_behind && p.z() < placement.near_z * w;
  }
  return !(all_left || all_right || all_above || all_below || all_behind) &&
         !ShowsBack(tile, placement);
}

double RowsOfTriangles(const AdaptiveMesh::Tile& tile, const GridPlacement& placement) {
  constexpr double kLargestHalfSamples = 2 * BlockCover::kRootSide;
  double rows = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto [p, w] = CornerOf(tile, placement, corner);
    if (!(p.z() >= placement.near_z * w) || !(p.z() > 0)) {
      return std::numeric_limits<double>::infinity();
    }
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector3d d = placement.from_grid.col(axis);
      rows = std::max(rows, std::abs(d.y() - p.y() / p.z() * d.z()) / p.z());
    }
  }
  return kLargestHalfSamples * rows;
}

}  // namespace dtr
