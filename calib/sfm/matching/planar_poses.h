// calib/sfm/matching/planar_poses.h -- the two relative poses that one plane leaves.
#pragma once
#include <array>
#include <optional>

#include "calib/sfm/matching/epipolar.h"

namespace dtr::sfm::matching {

/// The two poses under which a plane, in front of both cameras, gives the homography h (b ~ h a on
/// z = 1; Ma, Soatto, Kosecka, Sastry, "An Invitation to 3-D Vision", algorithm 5.2): matches of a
/// plane alone cannot tell which of them is right. `on_plane`: some of its matches, for the signs.
/// Empty where h has no such poses or is a rotation.
std::optional<std::array<RelativePose, 2>> PosesOfPlane(const Eigen::Matrix3d& h,
                                                        const PointPairs& on_plane);

}  // namespace dtr::sfm::matching
