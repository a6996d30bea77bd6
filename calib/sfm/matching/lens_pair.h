// calib/sfm/matching/lens_pair.h -- internal to calib/sfm/matching: matches of a pair as two lenses
// tell them.
#pragma once
#include <limits>
#include <vector>

#include "calib/sfm/matching/lens_vote.h"

namespace dtr::sfm::matching {

// Robust scales in long sides: wide on a grid, whose steps leave errors, then what features have.
inline constexpr double kGridScale = 3.0 / 1600, kScale = 1.0 / 1600;
// Weak priors keep what matches leave open in the ordinary; noise is in units of the scale.
inline constexpr double kPriorNoise = 0.3, kLogFocalDeviation = 0.5, kK1Deviation = 0.15;

/// The lenses of a pair's photos.
struct LensPair {
  VoteLens a, b;
};

/// The matches as two lenses tell: points on z = 1 and the distance there that is one unit of
/// scale.
struct Unbending {
  PointPairs points;
  std::vector<double> scale;
  int beyond = 0;  ///< matches that the lenses cannot have seen
};
Unbending Unbend(const LensPair& lenses, const PointPairs& from, double scale);

/// Sum of RobustCost over the matches; one that cannot have been seen costs 1.
double CostOf(const Unbending& matches, const RelativePose& pose);

struct Posed {
  RelativePose pose;
  double cost = std::numeric_limits<double>::infinity();
};

/// The pose after some steps from `start`; `scale` on the plane z = 1.
Posed Refined(const Unbending& matches, const RelativePose& start, double scale, int iterations);

/// The pose that the pair's fundamental matrix means with these lenses.
RelativePose FromFundamental(const VotePair& pair, const LensPair& lenses,
                             const Unbending& matches);

/// Costs and poses of a pair over a list of lenses; each is tried from the fundamental matrix, from
/// the pose at the lenses before and from those of a plane.
std::vector<Posed> OverLenses(const VotePair& pair, const std::vector<LensPair>& lenses);

/// The pose of a pair that a fresh search finds, or a plane's.
Posed Reposed(const VotePair& pair, const LensPair& lenses);

/// A lens of another focal length and k1.
VoteLens Stepped(const VoteLens& lens, double log_focal, double k1);

/// Focal lengths that are tried, from low to high at equal ratios.
std::vector<double> FocalGrid(bool fisheye);

}  // namespace dtr::sfm::matching
