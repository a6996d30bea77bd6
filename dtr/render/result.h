// dtr/render/result.h -- what every renderer gives back.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"

namespace dtr {

/// One rendered frame; all grids have the size of the novel camera.
struct RenderResult {
  ImageRgb8 image;                ///< 8-bit sRGB; black where unseen and not filled
  DepthImage depth;               ///< plane z of the front surface; hole where unseen
  Mask coverage;                  ///< 255 where some view saw the pixel (filling does not count)
  Grid<std::uint8_t> view_count;  ///< views blended at the pixel, at most 255
  Mask delta_border;              ///< 255: a fragment lay within 1e-4 Delta of the Delta border
  std::vector<int> views_used;    ///< indices of the views that took part, nearest first
  double coverage_share = 0;      ///< share of pixels seen
};

}  // namespace dtr
