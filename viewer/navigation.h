// viewer/navigation.h -- how a camera moves: pure functions on poses and lenses.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "dtr/render/camera_path.h"
#include "dtr/types/dtr_set.h"

namespace dtr::viewer {

/// The camera of a window of this size with the widest field of view that shows nothing beyond
/// `camera`: photos fill the window. K is scaled by one factor for both axes; its principal point
/// keeps its place relative to the middle.
PinholeCamera FillLens(const PinholeCamera& camera, int width_px, int height_px);

/// A direction of the camera's in the world.
Eigen::Vector3d AxisInWorld(const Pose& cam_from_world, const Eigen::Vector3d& axis_in_cam);

/// Mean direction of an axis of the cameras in the world, unit length; of cameras without a common
/// one (looking from all sides) the first one's. No camera: the axis itself.
Eigen::Vector3d CommonAxis(std::span<const Pose> cams_from_world,
                           const Eigen::Vector3d& axis_in_cam);

/// The world point a pixel shows. `depth_z` > 0, scene units.
Eigen::Vector3d WorldPoint(const NovelCamera& from, const Eigen::Vector2d& pixel, double depth_z);

/// Turns the camera about `pivot` (world): `yaw_rad` about `up`, then `pitch_rad` about the
/// camera's x axis. The pixel that shows the pivot goes on showing it. The camera never tilts over:
/// its axis stays kPoleRad away from straight up and down.
Pose Orbit(const Pose& cam_from_world, const Eigen::Vector3d& pivot, const Eigen::Vector3d& up,
           double yaw_rad, double pitch_rad);
inline constexpr double kPoleRad = 0.05;

/// Turns the camera where it stands.
Pose Look(const Pose& cam_from_world, const Eigen::Vector3d& up, double yaw_rad, double pitch_rad);

/// Moves the camera by `offset`, scene units along its own axes (x right, y down, z forward).
Pose MoveInCam(const Pose& cam_from_world, const Eigen::Vector3d& offset);

/// Moves the camera towards (factor < 1) or away from a world point, which keeps its pixel:
/// `factor` > 0 is the share of the distance that is left.
Pose Approach(const Pose& cam_from_world, const Eigen::Vector3d& point, double factor);

/// Moves the camera across its axis so that the point it sees at `from_px` at depth `depth_z`
/// is seen at `to_px`.
Pose Pan(const NovelCamera& camera, const Eigen::Vector2d& from_px, const Eigen::Vector2d& to_px,
         double depth_z);

/// The same camera where stored points are less by `origin_shift` than before: the origin moved.
NovelCamera InMovedWorld(NovelCamera camera, const Eigen::Vector3d& origin_shift);

/// Part of the way from one camera to another, 0 to 1: centres along a line, rotations along the
/// shortest arc, lenses in between. Both must have one size.
NovelCamera Between(const NovelCamera& from, const NovelCamera& to, double share);

/// The view whose camera is most like this one: by distance over `scene_size` plus the angle
/// between the axes in radians. Index into `views`; none when there is no view.
std::optional<size_t> NearestView(std::span<const View* const> views, const Pose& cam_from_world,
                                  double scene_size);

/// A pose from which all of `bounds` is inside the image of `lens`. It looks at the middle along
/// the mean axis of the cameras, level with `up`; where the cameras look in all directions along
/// the first one's. Where that is straight up or down, the top of the image is that of most of
/// theirs.
Pose ViewAll(const Bounds& bounds, std::span<const Pose> cams_from_world, const Eigen::Vector3d& up,
             const PinholeCamera& lens);

/// Pose of a camera at `center` that looks along `forward` with `up` upwards in the image.
Pose LookAlong(const Eigen::Vector3d& center, const Eigen::Vector3d& forward,
               const Eigen::Vector3d& up);

}  // namespace dtr::viewer
