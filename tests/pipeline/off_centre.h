// tests/pipeline/off_centre.h -- where exported points of an exact set lie in its images.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "dtr/types/view.h"

namespace dtr::testing {

/// Distance of a point from the nearest pixel centre of any view's depth grid, pixels; 1 where none
/// sees it. Fused clouds consist of such centres.
inline double OffCentrePx(const std::vector<View>& views, const Eigen::Vector3d& p) {
  double nearest = 1;
  for (const View& view : views) {
    const auto pixel = view.DepthCamera().PixelFromCam(view.cam_from_world * p);
    if (!pixel) continue;
    const Eigen::Vector2d off(pixel->x() - std::floor(pixel->x()) - 0.5,
                              pixel->y() - std::floor(pixel->y()) - 0.5);
    nearest = std::min(nearest, off.norm());
  }
  return nearest;
}

}  // namespace dtr::testing
