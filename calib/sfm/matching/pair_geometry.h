// calib/sfm/matching/pair_geometry.h -- from matches of the largest features to the geometry of a
// pair and matches of all features.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "calib/sfm/matching/guided.h"
#include "calib/sfm/matching/pair_choice.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm::matching {

/// Features of a photo as rays. The grid borrows points and descriptors: this moves, but is not
/// copied.
struct RayFeatures {
  RayFeatures() = default;
  RayFeatures(RayFeatures&&) = default;
  RayFeatures& operator=(RayFeatures&&) = default;

  LoadedDescriptors descriptors;
  std::vector<Eigen::Vector2d> points;  ///< on z = 1; NaN: no ray
  FeatureGrid grid;
  double band = 0;        ///< BandOf at the centre, on z = 1
  double band_share = 0;  ///< share of the photo within a band of a line
};

RayFeatures RaysOf(const std::vector<Keypoint>& keypoints, LoadedDescriptors descriptors,
                   const calib::LensCamera& camera);

/// An essential matrix (a fundamental matrix where a focal length is not known) by the coarse
/// matches, all features along its lines, and a second robust fit to these. Nothing where too few
/// agree.
std::optional<PairGeometry> GeometryOf(const RayFeatures& a, const RayFeatures& b,
                                       const CoarsePair& coarse, bool focal_is_known,
                                       std::uint64_t seed);

}  // namespace dtr::sfm::matching
