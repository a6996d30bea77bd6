// dtr/render/hole_cost.h -- SPEC 7.3: how little the views agree that a surface lies at a depth,
// for several depths at once with the processor's vector instructions. Only dtr/render's own .cpp
// files and its tests include this.
#pragma once
#include <cstddef>
#include <span>

namespace dtr {

/// A view as it is asked about a position of the image.
struct CostView {
  double pixel_at_infinity[3], pixel_per_inverse_depth[3];  ///< homogeneous pixel of the view
  double centre[3];                                         ///< in the novel frame
  double tolerance;  ///< differences of 1/z up to this are the same surface
  int width_px, height_px;
  const float* depth;  ///< plane z, `depth_columns` in a row, a value for depth_scale^2 pixels
  int depth_columns, depth_scale;
  const float* cells;  ///< R, G, B in sRGB levels and 1, or all 0 where masked; row by row
  int cell_columns, cell_rows;
};

/// A position of the image.
struct CostPlace {
  double ray[3], ray_squared;  ///< z = 1
  int cell_px;                 ///< of the views' cells
};

constexpr float kMaxHoleCost = 40;  ///< levels of sRGB

/// costs[i] of inverse_depths[i]. The same bytes whatever the processor's vectors hold.
void HoleCosts(const CostPlace& place, std::span<const CostView> views,
               std::span<const double> inverse_depths, float* costs);

}  // namespace dtr
