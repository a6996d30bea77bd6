// calib/sfm/mapping/pair_selection.h -- internal to calib/sfm/mapping: which pairs can be relied
// on, and the rotations that they agree on.
#pragma once
#include <string>
#include <vector>

#include "calib/sfm/mapping/global_mapper.h"
#include "calib/sfm/mapping/rotation_averaging.h"

namespace dtr::sfm {

/// Pairs with fewer matches are not used.
inline constexpr int kMinPairMatches = 15;

struct Rotations {
  std::vector<Eigen::Matrix3d> cam_from_world;  ///< per image
  std::vector<char> connected;                  ///< per image: in the largest part
  std::vector<int> pairs;                       ///< that agree, the most matches first
  std::vector<LeftOut> left_out;
  std::string why_not;
};

/// What is rotated and placed as one: an image, or all images of a station. Nodes are called by the
/// first of their images.
std::vector<int> NodesOf(const ViewGraph& graph);

/// Triplets, averaging, filtering, each followed by the largest connected part. Throws Interrupted.
Rotations SelectPairs(const ViewGraph& graph, const Rays& rays, const MapOptions& options,
                      MapStatistics* statistics);

/// What a feature's position is known to, in rad, per image.
std::vector<double> SigmasOf(const ViewGraph& graph);

}  // namespace dtr::sfm
