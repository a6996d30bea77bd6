#include "stereo/time_step.h"

namespace dtr::stereo {

void KeepSettledPlanes(const TimeStep& time_step, PlaneMap* map) {
  const PlaneMap& kept = time_step.background;
  if (kept.empty()) return;
  const auto scale = static_cast<float>(map->unit_z / kept.unit_z);
  for (int y = 0; y < map->inverse_depth.height(); ++y) {
    for (int x = 0; x < map->inverse_depth.width(); ++x) {
      if (time_step.open(x, y) != 0) continue;
      map->inverse_depth(x, y) = scale * kept.inverse_depth(x, y);
      map->slope_x(x, y) = scale * kept.slope_x(x, y);
      map->slope_y(x, y) = scale * kept.slope_y(x, y);
    }
  }
}

void KeepSettledDepth(const TimeStep& time_step, DepthEstimate* estimate) {
  for (int y = 0; y < estimate->depth.height(); ++y) {
    for (int x = 0; x < estimate->depth.width(); ++x) {
      if (time_step.open(x, y) != 0) continue;
      estimate->depth(x, y) = time_step.settled.depth(x, y);
      estimate->inverse_depth_sigma(x, y) = time_step.settled.inverse_depth_sigma(x, y);
    }
  }
}

}  // namespace dtr::stereo
