// viewer/world_up.h -- which way is up in a set's world.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "dtr/types/dtr_set.h"

namespace dtr::viewer {

/// Cosine to straight down, 35 degrees: cameras that look down more steeply take images from the
/// air, others what lies ahead of them.
inline constexpr double kFromTheAir = 0.8191520442889918;

/// Up, unit length, world frame. Where GPS gave the set axes east, north and up it is z. Else it is
/// estimated from the source cameras of a frame (UpOfCameras); the views' order does not matter
/// but where only one of them can tell.
Eigen::Vector3d WorldUp(const DtrSet& set, size_t frame = 0);

/// z, where the set's provenance says that its axes are east, north and up, and its places say how
/// these are turned.
std::optional<Eigen::Vector3d> KnownUp(const DtrSet& set);

/// An estimate for cameras that people or drones hold: the direction most perpendicular to all of
/// the images' x axes, for these are level as a rule; single cameras that were held otherwise are
/// outvoted (least absolute deviations). Axes that are all parallel leave a turn about themselves
/// open. That, the sign, and all of it where cameras are rolled at will, is decided by
/// - the plane the cameras stand in, where they look straight at it from afar, as in flights, or
///   where it is roughly level by their own idea of up,
/// - else the mean of what is up in their images,
/// - else, where they all look the same way with no common up, the opposite of that,
/// - else what is up in the first image.
/// No camera: -y. What cannot be told apart from a flight is a rig before a wall that is as wide
/// and as high as half its distance, and from a rig a flight along one line on one heading.
Eigen::Vector3d UpOfCameras(std::span<const Pose> cams_from_world,
                            const Eigen::Vector3d& scene_center);

/// What is up in most of the images (unit length, world frame), whatever is up in the world: where
/// cameras look down it is the top of their images. Without a common one it is the first one's.
Eigen::Vector3d UpInImages(std::span<const Pose> cams_from_world);

}  // namespace dtr::viewer
