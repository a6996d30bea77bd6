// calib/sfm/matching/nearest.h -- nearest descriptors by exact search, with vector instructions.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "calib/sfm/view_graph.h"

namespace dtr::sfm::matching {

/// The descriptor of another photo most like one: by the largest dot product, ties to the lower
/// index.
struct Nearest {
  int index = -1;   ///< -1: there is none
  int dot = 0;      ///< dot product with it
  int second = -1;  ///< dot product with the next best; -1: there is none
};

/// Nearest of each of a among b and of each of b among a.
struct NearestBothWays {
  std::vector<Nearest> of_a, of_b;
};

/// All dot products of a and b, each once. Exact: products of bytes sum to less than 2^24, which
/// single precision holds, in any order of summing.
NearestBothWays FindNearest(std::span<const Descriptor> a, std::span<const Descriptor> b);

/// dots[i] = query . rows[chosen[i]]; `dots` has the size of `chosen`.
void DotProducts(const Descriptor& query, std::span<const Descriptor> rows,
                 std::span<const int> chosen, std::span<int> dots);

/// Angle between two descriptors whose length is 512, from their dot product (COLMAP's measure).
float DescriptorAngle(int dot);

/// True when the nearest passes the ratio test on angles (Lowe, IJCV 2004, section 7.1).
bool IsDistinct(const Nearest& nearest, float ratio);

}  // namespace dtr::sfm::matching
