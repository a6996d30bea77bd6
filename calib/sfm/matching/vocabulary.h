// calib/sfm/matching/vocabulary.h -- words that descriptors which look alike share.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "calib/sfm/view_graph.h"

namespace dtr::sfm::matching {

/// A vocabulary tree of two levels (Nister and Stewenius, CVPR 2006) by k-means on the sphere.
class Vocabulary {
 public:
  /// About `words` words, learnt from a sample. Deterministic for any number of threads.
  Vocabulary(std::span<const Descriptor> sample, size_t words, std::uint64_t seed);

  size_t Size() const { return size_; }
  /// The word of each descriptor, in [0, Size()).
  std::vector<int> WordsOf(std::span<const Descriptor> descriptors) const;

 private:
  std::vector<Descriptor> top_;                 ///< centres of the first level
  std::vector<std::vector<Descriptor>> below_;  ///< of the second, per centre of the first
  std::vector<int> first_word_;                 ///< per centre of the first level
  size_t size_ = 0;
};

}  // namespace dtr::sfm::matching
