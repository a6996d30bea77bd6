// calib/sfm/matching/zoom_vote.h -- focal lengths of photos that were zoomed one by one.
#pragma once
#include <map>
#include <optional>
#include <vector>

#include "calib/sfm/matching/lens_vote.h"

namespace dtr::sfm::matching {

/// The focal length of one photo, in long sides.
struct PhotoFocal {
  double focal = 1;
  double log_deviation = 0;  ///< standard deviation of its logarithm; infinite where it is unknown
};

struct ZoomResult {
  std::map<int, PhotoFocal> photos;  ///< by VotePair::photo_a and photo_b
  double k1 = 0;                     ///< of all
  double cost = 0;                   ///< sum of RobustCost over all matches
};

/// Focal lengths of all photos of the pairs, and one k1: those for which essential matrices explain
/// the matches best. Most photos are taken to have one focal length in common: one that is off it
/// by more than a few percent costs as much as some matches that nothing explains. Every pair is
/// posed for all focal lengths of a grid on either side; photos take turns for the best of them,
/// from every start that has them equal; from each result Levenberg-Marquardt over focal lengths,
/// k1 and poses together, of which the best is taken: small photos are explained nearly as well by
/// long focal lengths. Empty without pairs. Deterministic for any number of threads.
std::optional<ZoomResult> VoteOnZoom(const std::vector<VotePair>& pairs,
                                     const VoteOptions& options);

/// What these focal lengths (long sides, of every photo of the pairs) leave: k1 and poses are
/// fitted, focal lengths held. To compare with VoteOnZoom. Empty without pairs.
std::optional<ZoomResult> CostOfFocals(const std::vector<VotePair>& pairs,
                                       const std::map<int, double>& focals,
                                       const VoteOptions& options);

}  // namespace dtr::sfm::matching
