// calib/sfm/matching/pair_kind.h -- is a pair a plane, or a rotation alone?
#pragma once
#include <cstdint>

#include "calib/sfm/matching/epipolar.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm::matching {

/// One homography explains a pair where at least this share of the matches agrees with it.
inline constexpr double kPlanarShare = 0.8;

/// Sets kind, rotation, translation and parallax of a pair from its pose and the matches (on
/// z = 1) that agree with it. `threshold`: distance of a match from a homography that it agrees
/// with. kRotation: the median angle after the best rotation is below 0.2 degrees.
void ClassifyPair(const RelativePose& pose, const PointPairs& points, double threshold,
                  std::uint64_t seed, PairGeometry& pair);

}  // namespace dtr::sfm::matching
