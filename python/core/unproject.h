// python/core/unproject.h -- depth maps as points of the world.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/types/view.h"
#include "python/core/open_set.h"

namespace dtr::python {

/// A point for each pixel with depth, row by row; lists of three numbers a point where a point has
/// several.
struct Unprojected {
  std::vector<double> points;        ///< x, y, z in the set's world, scene units
  std::vector<std::uint8_t> rgb;     ///< of the image at the depth pixel's centre
  std::vector<double> sigma;         ///< std. deviation along the ray, scene units; NaN: not known
  std::vector<double> directions;    ///< unit vectors of the world from the camera to the point
  std::vector<std::int32_t> pixels;  ///< x, y of the depth map: two numbers a point
  std::vector<std::uint8_t> completed;  ///< 1: not measured
};

/// The points of one view. Pixels that the mask leaves out have none. With `completed` there are
/// those that were completed, too, whose deviation is not known. Throws Error where the view has no
/// depth.
Unprojected Unproject(OpenSet& set, ViewPlace at, bool completed);

}  // namespace dtr::python
