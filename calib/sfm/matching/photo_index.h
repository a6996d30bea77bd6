// calib/sfm/matching/photo_index.h -- which photos show the same, without comparing all with all.
#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "calib/sfm/view_graph.h"
#include "dtr/base/progress.h"

namespace dtr::sfm::matching {

/// Descriptors of all photos by the words of a vocabulary that is learnt from them. Some 150 bytes
/// a descriptor.
class PhotoIndex {
 public:
  /// `descriptors_of(photo)` is called once for each photo, by several threads. Deterministic for
  /// any number of threads.
  PhotoIndex(int photos, const std::function<std::vector<Descriptor>(int)>& descriptors_of,
             std::uint64_t seed, Progress& progress);

  /// How much of what a photo shows each photo shows; 0 for itself. The sum over its descriptors of
  /// log(photos / photos that have it) (inverse document frequency: Sivic and Zisserman, ICCV
  /// 2003), where a photo has it whose nearest descriptor of the same word is nearer than 0.8 of
  /// the word's median: a ratio test against what is alike by chance.
  std::vector<float> ScoresOf(int photo) const;

 private:
  struct Place {
    int word, at;
  };
  std::vector<std::vector<Place>> of_photo_;      ///< of each of its descriptors
  std::vector<std::vector<Descriptor>> in_word_;  ///< per word
  std::vector<std::vector<int>> photo_in_word_;   ///< whose they are, rising
};

}  // namespace dtr::sfm::matching
