// calib/sfm/mapping/positioning.h -- internal to calib/sfm/mapping: positions of all cameras at
// once, their rotations known.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "calib/sfm/mapping/pair_poses.h"
#include "calib/sfm/mapping/tracks.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

/// Camera centres in an arbitrary gauge, and how well the rays meet.
struct Positions {
  std::vector<Eigen::Vector3d> centres;  ///< per image; only those that a track has
  double cost = 0;  ///< mean loss per observation, of sines of angles between ray and point
};

/// Global positioning (Pan et al. 2024, eq. 4; the bilinear objective of Zhuang et al. 2018): over
/// centres c, points X and a factor d > 0 of each observation it minimises Huber's loss of
/// |v - d (X - c)|, v the ray in the world. Images of one `node_of` have one centre. Random starts
/// from `seed`, of which the best end counts. Levenberg-Marquardt by hand: factors, then points are
/// eliminated; the centres' equations are solved by conjugate gradients. `tracks`: of these a part
/// that covers all images is used.
Positions PlaceCameras(std::span<const Eigen::Matrix3d> cam_from_world, const Rays& rays,
                       std::span<const int> node_of, std::span<const Track> tracks,
                       std::uint64_t seed, const Progress* progress);

/// Long tracks first, until every image has `per_image` of them, as indices in rising order. Tracks
/// that only images with enough have are left out.
std::vector<int> CoveringTracks(int images, std::span<const Track> tracks, int per_image);

}  // namespace dtr::sfm
