// dtr/eval/visibility.h -- which surfaces which cameras see, from true depth.
#pragma once
#include <span>

#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr::eval {

/// A camera with the true depth of what it sees: plane z at the pixel centres of `camera`.
/// Borrowed.
struct TrueView {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
  const DepthImage* depth = nullptr;
};

/// True when `p_in_world` lies on the surface that the view sees: inside its image and not behind
/// the true surface by more than a tolerance (a thousandth of the depth where the 2x2 true pixels
/// around are one smooth surface, whose inverse depth is interpolated; 1 % at edges, where the
/// nearest pixel decides).
bool Sees(const TrueView& view, const Eigen::Vector3d& p_in_world);

/// For every pixel of `novel` with true depth: how many of `others` see its surface point (at most
/// 255). 0 where there is no truth. Does not depend on `threads` (0: all cores).
/// Throws Error when a depth map is missing or has not its camera's size.
Grid<std::uint8_t> CountSeenBy(const TrueView& novel, std::span<const TrueView> others);

/// Of the novel pixels whose true surface point some source view sees, the share that `coverage`
/// (255: the renderer saw it) contains. 1 when no such pixel exists.
double VisibleCoverage(const TrueView& novel, std::span<const TrueView> sources,
                       const Mask& coverage);

/// 255 where the true surface point is seen in at least `min_views` of `others`.
Mask VisibleMask(const TrueView& view, std::span<const TrueView> others, int min_views = 2);

/// 255 where the luma (BT.601, of the sRGB values) of the 9x9 pixels around, cut at the border, has
/// a standard deviation of at least 4 levels.
Mask TexturedMask(const ImageRgb8& image);

}  // namespace dtr::eval
