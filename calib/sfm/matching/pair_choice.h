// calib/sfm/matching/pair_choice.h -- which photos of many are worth matching.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "calib/sfm/matching/match_photos.h"

namespace dtr::sfm::matching {

inline constexpr size_t kPartners = 20;  ///< of each photo, where pairs are preselected

/// The pairs (a < b, sorted): those that may be matched, or, preselected of them, each photo with
/// the next and with its partners by the number of matches among the 300 largest features: the
/// nearest 12, the others spread geometrically by rank, so that not all baselines are short. Of
/// more than 101 photos only the 100 that an index (photo_index.h) ranks first are compared with
/// each, so that the work grows with the number of photos.
/// Throws std::invalid_argument where a pair names no two photos.
std::vector<std::pair<int, int>> ChoosePairs(std::span<const MatchPhoto> photos,
                                             const MatchOptions& options, Progress& progress);

/// A match of two photos' largest features, with what is known of its trust: ratio of the angles to
/// the nearest and the next, smaller is better.
struct CoarseMatch {
  int a = 0, b = 0;
  float ratio = 0;
};

/// The matches of the largest features of two photos.
struct CoarsePair {
  int a = 0, b = 0;
  std::vector<CoarseMatch> matches;
};

/// Descriptors of a photo: those that it has, or that were loaded.
struct LoadedDescriptors {
  std::vector<Descriptor> loaded;
  std::span<const Descriptor> all;  ///< of `loaded`, or of the photo
};

/// The descriptors of the `largest` first features of a photo, or of all where it has fewer. Throws
/// std::invalid_argument where options.load_descriptors gives another number.
LoadedDescriptors DescriptorsOf(std::span<const MatchPhoto> photos, int photo, size_t largest,
                                const MatchOptions& options);

/// What each of them takes, at most.
std::vector<double> DescriptorBytes(std::span<const MatchPhoto> photos, size_t largest);

/// Mutual nearest neighbours that pass the ratio test both ways, the most trusted first.
std::vector<CoarseMatch> CoarseMatches(std::span<const Descriptor> a,
                                       std::span<const Descriptor> b);

}  // namespace dtr::sfm::matching
