// calib/sfm/mapping/global_mapper.h -- from a graph of matched photos to cameras and points, all
// photos at once.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "calib/sfm/view_graph.h"
#include "calib/sfm_model.h"
#include "dtr/base/progress.h"

namespace dtr::sfm {

struct MapOptions {
  std::uint64_t seed = 0;
  bool intrinsics_are_known = false;  ///< the graph's cameras hold; any model will do
  bool focals_are_known = false;      ///< their focal lengths do
  /// Receives the steps; asked between them, and within the long ones, whether to stop (Interrupted
  /// is thrown). Null: neither.
  Progress* progress = nullptr;
};

/// An image that the model lacks, and why.
struct LeftOut {
  int image = 0;  ///< index into ViewGraph::images
  std::string why;
};

/// What happened on the way.
struct MapStatistics {
  int pairs = 0;                   ///< of the graph
  int pairs_without_rotation = 0;  ///< too few matches, or no rotation that explains them
  int pairs_dropped = 0;           ///< contradicted by triplets or by the averaged rotations
  double rotation_median_deg = 0,
         rotation_misfit = 0;  ///< medians after filtering; misfit in sigmas
  double positioning_cost = 0;
  int tracks = 0, points = 0, observations = 0, registered = 0, resected = 0;
  double error_median_px = 0, error_rms_px = 0;
  /// Of all matches: in pairs that the result contradicts and does not explain (repetition.h).
  double contradicted_share = 0;
};

struct Mapped {
  /// Image ids and camera ids are indices + 1. Every registered image has all its pixels as
  /// features. World: arbitrary, cameras within about 10 units of the origin.
  calib::SfmModel model;
  std::vector<LeftOut> left_out;
  /// Empty: accepted. Else one clause why the result must not be trusted; the model may be empty.
  std::string why_not;
  MapStatistics statistics;
};

/// Global structure from motion (Pan et al. 2024, GLOMAP):
///   1. relative rotations refitted with their covariance; triplets; averaging; pairs that disagree
///      by more than their own certainty allows are dropped; the largest connected part goes on
///   2. tracks, and the positions of all cameras and points at once
///   3. bundle adjustments under Cauchy's loss, intrinsics free from the second on (focal length
///      and distortion; principal points stay), with all tracks triangulated again in between
///   4. images that have no points are resected, or left out with the reason
///   5. acceptance (why_not)
/// Images of one station are rotated and placed as one throughout; intrinsics must be known then.
/// Same bytes for any number of threads. Throws std::invalid_argument where an index of the graph
/// is out of range, a camera is none or a pixel is not finite.
Mapped MapGlobally(const ViewGraph& graph, const MapOptions& options);

}  // namespace dtr::sfm
