// tests/gl/moved_worlds.h -- one scene in other units and places, and what may differ then.
#pragma once
#include "tests/gl/gl_testing.h"

namespace dtr::testing {

// Single precision moves a vertex by 1e-4 px at most; a pixel on an outline may change hands, any
// other by one level of 255.
inline constexpr int kSameLevels = 1;
inline constexpr double kOutlineShare = 0.005;

/// Share of the pixels more than that apart, or seen in one picture alone.
inline double ShareApart(const RenderResult& a, const RenderResult& b) {
  long long apart = 0;
  for (int y = 0; y < a.image.height(); ++y) {
    for (int x = 0; x < a.image.width(); ++x) {
      apart += PixelDifference(a.image, b.image, x, y) > kSameLevels ||
               a.coverage(x, y) != b.coverage(x, y);
    }
  }
  return static_cast<double>(apart) / static_cast<double>(a.coverage.data().size());
}

/// The world scaled and moved; the picture must not know.
inline DtrSet Moved(DtrSet set, double scale, const Eigen::Vector3d& offset) {
  for (View& view : set.frames[0].views) {
    const Eigen::Vector3d centre = scale * view.CenterInWorld() + offset;
    view.cam_from_world.translation = -(view.cam_from_world.rotation * centre);
    for (float& depth : view.depth.grid().data()) depth *= static_cast<float>(scale);
  }
  FinishGeometry(set);
  return set;
}
inline Shot Moved(Shot shot, double scale, const Eigen::Vector3d& offset) {
  const Eigen::Vector3d centre = scale * shot.cam_from_world.TargetOriginInSource() + offset;
  shot.cam_from_world.translation = -(shot.cam_from_world.rotation * centre);
  return shot;
}

}  // namespace dtr::testing
