// calib/sfm/run/match_summary.h -- what matching found, without the matches themselves.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dtr::sfm {

/// Of a workspace's photos, by their numbers.
struct MatchSummary {
  struct Pair {
    size_t a = 0, b = 0;
    std::int64_t common = 0;      ///< features that agree with one geometry of the pair
    bool one_homography = false;  ///< which explains them: a plane, or no parallax
    /// Half of them or more lie at the same position in both photos.
    bool still = false;
  };
  std::vector<std::int64_t> features;  ///< of each photo
  std::vector<Pair> pairs;             ///< those with features in common
};

}  // namespace dtr::sfm
