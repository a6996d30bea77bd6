// calib/matched_pair.h -- features that two photos have in common.
#pragma once
#include <Eigen/Core>
#include <utility>
#include <vector>

namespace dtr::calib {

/// Pixels of two photos (corner origin, distorted as the photos are) that show the same points as
/// far as one two-view geometry of their own says, which no known camera had a part in.
struct MatchedPair {
  int a = 0, b = 0;  ///< indices into a list of photos
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> pixels;
};

}  // namespace dtr::calib
