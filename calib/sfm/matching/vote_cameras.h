// calib/sfm/matching/vote_cameras.h -- which matches vote on which camera, and what becomes of it.
#pragma once
#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "calib/sfm/matching/match_photos.h"
#include "calib/sfm/matching/pair_choice.h"

namespace dtr::sfm::matching {

/// Distance from an epipolar line that still counts, as a share of the photo's long side: 4 pixels
/// of 1600. Distortion that a radial lens has no more terms for, and features found at a large
/// scale, take what localisation leaves. One pixel at least, to which features of small photos are
/// no better known than those of large ones.
inline double BandOf(double long_side_px) { return std::max(4.0 / 1600, 1 / long_side_px); }

/// Votes (lens_vote.h) on focal length and k1 of every camera, by the pairs whose photos both have
/// it; cameras of one photo whose priors are the same vote together. At most 40 pairs vote, those
/// with many matches and parallax; those that one homography explains have no vote on the focal
/// length. Cameras of one photo each may be zoomed one by one: where a focal length of every
/// photo's own (zoom_vote.h) explains the matches clearly better, each gets its own, and those that
/// the matches do not determine get the median. A focal length from EXIF holds unless the vote
/// contradicts it by more than 15 % and three standard deviations at a clearly lower cost. Updates
/// cameras and focal_is_known of `graph` and adds to `notes`.
void VoteOnCameras(std::span<const MatchPhoto> photos, std::span<const CoarsePair> pairs,
                   const MatchOptions& options, ViewGraph& graph, std::vector<std::string>& notes);

}  // namespace dtr::sfm::matching
