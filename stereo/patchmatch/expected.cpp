#include "stereo/patchmatch/expected.h"
#include "dtr/base/parallel_for.h"

namespace dtr::stereo::patchmatch {

Expected ExpectedOf(const Level& level, const PriorPlanes& planes, const RelativeNoise& noise,
                    const DepthRange& range) {
  const int width = level.reference.width, height = level.reference.height;
  const BorderedGrid none(width, height, 0);
  Expected expected{none, none, none, none};
  ParallelFor(0, height, [&](int y) {
    for (int x = 0; x < width; ++x) {
      const auto plane = planes.At({(x + 0.5) / width, (y + 0.5) / height});
      if (!plane) continue;
      // Inverse depths of a level are in units of the range's near end.
      const auto w = static_cast<float>(range.near_z * plane->inverse_depth);
      if (!(w >= level.w_min) || !(w <= level.w_max)) continue;
      *expected.w.at(x, y) = w;
      *expected.a.at(x, y) = static_cast<float>(range.near_z * plane->slope_x / width);
      *expected.b.at(x, y) = static_cast<float>(range.near_z * plane->slope_y / height);
      if (plane->at_edge) continue;
      *expected.inverse_sigma.at(x, y) =
          static_cast<float>(1 / (static_cast<double>(w) * noise.At(1 / plane->inverse_depth)));
    }
  });
  return expected;
}

}  // namespace dtr::stereo::patchmatch
