// datasets/layout.h -- where the cameras of a synthetic capture stand.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "datasets/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::datasets {

/// cam_from_world of a camera at `eye` that looks at `target`, upright (world z up).
/// Requires the viewing direction not to be vertical.
Pose LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

/// Poses (cam_from_world) of `views` cameras before or inside a scene:
///   arc         around the focus on its -y side, 6 degrees apart, closer when the arc would grow
///               beyond what the scene leaves free; heights vary a little, as a walking person's
///   grid        rows and columns on a plane, neighbours a tenth of the distance apart
///   ring        a full turn around the focus
///   line        sideways past the focus with parallel axes, a tenth of the distance apart
///   inside-out  on a small circle, looking outwards
/// Throws UsageError for views < 2 and for layouts the scene has no room for, naming those it has.
std::vector<Pose> MakeLayout(const Scene& scene, const std::string& layout, int views);

/// An ideal camera of this size whose principal point is the image's centre. `focal_35mm` is the
/// focal length for a frame 36 mm wide, whatever the height: fx = fy = focal_35mm / 36 * width.
PinholeCamera MakeCamera(int width_px, int height_px, double focal_35mm = 28);

}  // namespace dtr::datasets
