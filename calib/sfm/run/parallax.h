// calib/sfm/run/parallax.h -- did the camera move against what the photos show? From their matches.
#pragma once
#include <string>
#include <vector>

#include "calib/sfm/run/match_summary.h"
#include "calib/sfm/run/sfm.h"

namespace dtr::sfm {

/// What the matched pairs show.
struct PairCounts {
  int photos = 0;
  int matched = 0;  ///< pairs with features in common that agree with one geometry
  /// Of those, pairs that COLMAP calls planar, panoramic or a watermark: one homography explains
  /// them, so they hold no parallax (unless everything lies in one plane).
  int without_parallax = 0;
  /// Of the matched pairs, those in which half of the common features or more lie at the same
  /// position in both photos: the camera did not move against what these photos show most of.
  int still = 0;
};

PairCounts CountPairs(const MatchSummary& matches);

/// Of a pair of photos, of which `photo` is the first: half or more of the features moved so little
/// that they lie at the same position.
bool AreStill(const std::vector<double>& moved_px, const SfmImageInput& photo);

/// Half of the matched pairs or more are `still`.
bool CameraStoodStill(const PairCounts& counts);

/// A sentence for counts in which half of the matched pairs or more are `still` or
/// `without_parallax`, with what helps; empty for others.
std::string LackOfParallax(const PairCounts& counts);

/// A sentence for counts with fewer matched pairs than a chain of all photos has, with what helps;
/// empty for others.
std::string LackOfPairs(const PairCounts& counts);

/// Why the mapper made no model of these photos, and what helps.
std::string WhyNoModel(const PairCounts& counts);

}  // namespace dtr::sfm
