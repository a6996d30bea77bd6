#include "calib/sfm/matching/pair_choice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>

#include "calib/sfm/matching/nearest.h"
#include "calib/sfm/matching/photo_index.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm::matching {
namespace {

constexpr float kRatio = 0.8f;       // Lowe's
constexpr size_t kGlance = 300;      // features of a photo that tell whether photos overlap
constexpr size_t kIndexed = 600;     // features of a photo that an index of many photos has
constexpr size_t kLookedAt = 100;    // photos that an index ranks first, whose glances are compared
constexpr size_t kNearestKept = 12;  // of the partners, by rank; the others are spread

// Of photos with their scores, those to match a photo with.
std::vector<int> PartnersOf(std::vector<std::pair<int, int>> scored) {
  std::erase_if(scored, [](const auto& photo_score) { return photo_score.second <= 0; });
  std::stable_sort(scored.begin(), scored.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  std::vector<int> order;
  for (const auto& [photo, score] : scored) order.push_back(photo);
  if (order.size() <= kPartners) return order;
  constexpr size_t kFar = kPartners - kNearestKept;
  const double factor = std::pow(static_cast<double>(order.size()) / kNearestKept, 1.0 / kFar);
  size_t last = kNearestKept - 1;
  for (size_t k = 1; k <= kFar; ++k) {
    const double rank = kNearestKept * std::pow(factor, static_cast<double>(k));
    last = std::clamp(static_cast<size_t>(std::lround(rank)) - 1, last + 1,
                      order.size() - 1 - (kFar - k));
    order[kNearestKept + k - 1] = order[last];
  }
  order.resize(kPartners);
  return order;
}

// Throws where a pair names no two photos.
void Check(const std::vector<std::pair<int, int>>& pairs, int photos) {
  for (const auto& [a, b] : pairs) {
    if (a < 0 || b >= photos || a >= b)
      throw std::invalid_argument("MatchPhotos: a pair of no two photos");
  }
}

std::vector<std::pair<int, int>> AllPairs(int photos) {
  std::vector<std::pair<int, int>> pairs;
  for (int a = 0; a < photos; ++a) {
    for (int b = a + 1; b < photos; ++b) pairs.emplace_back(a, b);
  }
  return pairs;
}

// Pairs worth a closer look: all that are allowed of few photos; of many each photo with those that
// an index ranks first, and with the next.
std::vector<std::pair<int, int>> Candidates(std::span<const MatchPhoto> photos,
                                            const MatchOptions& options, Progress& progress) {
  const int count = static_cast<int>(photos.size());
  if (options.pairs && options.pairs->size() <= photos.size() * kLookedAt / 2) {
    return *options.pairs;
  }
  if (photos.size() <= kLookedAt + 1) return options.pairs ? *options.pairs : AllPairs(count);
  const PhotoIndex index(
      count,
      [&](int i) {
        const auto all = DescriptorsOf(photos, i, kIndexed, options).all;
        return std::vector<Descriptor>(all.begin(), all.end());
      },
      options.seed, progress);
  const auto is_allowed = [&](int a, int b) {
    return !options.pairs || std::binary_search(options.pairs->begin(), options.pairs->end(),
                                                std::pair(std::min(a, b), std::max(a, b)));
  };
  progress.Stage("ranking photos", count);
  std::vector<std::vector<int>> ranked(photos.size());
  std::atomic<int> done = 0;
  ParallelFor(0, count, [&](int a) {
    progress.ThrowIfInterrupted();
    const std::vector<float> scores = index.ScoresOf(a);
    std::vector<int>& order = ranked[static_cast<size_t>(a)];
    for (int b = 0; b < count; ++b) {
      if (scores[static_cast<size_t>(b)] > 0 && is_allowed(a, b)) order.push_back(b);
    }
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
      return scores[static_cast<size_t>(i)] > scores[static_cast<size_t>(j)];
    });
    order.resize(std::min(order.size(), kLookedAt));
    progress.Update(++done);
  });
  std::set<std::pair<int, int>> pairs;
  for (int a = 0; a < count; ++a) {
    for (const int b : ranked[static_cast<size_t>(a)]) {
      pairs.emplace(std::min(a, b), std::max(a, b));
    }
    if (a + 1 < count && is_allowed(a, a + 1)) pairs.emplace(a, a + 1);
  }
  return {pairs.begin(), pairs.end()};
}

// The number of matches among the largest features, of each pair.
std::vector<int> ScoresOf(std::span<const MatchPhoto> photos,
                          const std::vector<std::pair<int, int>>& pairs,
                          const MatchOptions& options, Progress& progress) {
  std::vector<int> scores(pairs.size(), 0);
  constexpr int kPairsAtOnce = 256;
  const int count = static_cast<int>(pairs.size());
  const int chunks = (count + kPairsAtOnce - 1) / kPairsAtOnce;
  progress.Stage("comparing photos", chunks);
  std::vector<LoadedDescriptors> largest(photos.size());
  ParallelFor(0, static_cast<int>(photos.size()), [&](int i) {
    largest[static_cast<size_t>(i)] = DescriptorsOf(photos, i, kGlance, options);
  });
  std::atomic<int> done = 0;
  ParallelFor(0, chunks, [&](int chunk) {
    progress.ThrowIfInterrupted();
    for (int k = chunk * kPairsAtOnce; k < std::min(count, (chunk + 1) * kPairsAtOnce); ++k) {
      const auto [a, b] = pairs[static_cast<size_t>(k)];
      scores[static_cast<size_t>(k)] =
          static_cast<int>(CoarseMatches(largest[a].all, largest[b].all).size());
    }
    progress.Update(++done);
  });
  return scores;
}

}  // namespace

LoadedDescriptors DescriptorsOf(std::span<const MatchPhoto> photos, int photo, size_t largest,
                                const MatchOptions& options) {
  const Features& features = photos[static_cast<size_t>(photo)].features;
  const size_t count = std::min(largest, features.keypoints.size());
  LoadedDescriptors descriptors;
  if (options.load_descriptors) {
    descriptors.loaded = options.load_descriptors(photo, count);
    if (descriptors.loaded.size() != count) {
      throw std::invalid_argument("MatchPhotos: keypoints and loaded descriptors differ in number");
    }
    descriptors.all = descriptors.loaded;
  } else {
    descriptors.all = std::span(features.descriptors).first(count);
  }
  return descriptors;
}

std::vector<double> DescriptorBytes(std::span<const MatchPhoto> photos, size_t largest) {
  std::vector<double> bytes;
  for (const MatchPhoto& photo : photos) {
    bytes.push_back(static_cast<double>(std::min(largest, photo.features.keypoints.size()) *
                                        sizeof(Descriptor)));
  }
  return bytes;
}

std::vector<CoarseMatch> CoarseMatches(std::span<const Descriptor> a,
                                       std::span<const Descriptor> b) {
  const NearestBothWays nearest = FindNearest(a, b);
  std::vector<CoarseMatch> matches;
  for (size_t i = 0; i < nearest.of_a.size(); ++i) {
    const Nearest& there = nearest.of_a[i];
    if (there.index < 0) continue;
    const Nearest& back = nearest.of_b[static_cast<size_t>(there.index)];
    if (back.index != static_cast<int>(i)) continue;
    if (!IsDistinct(there, kRatio) || !IsDistinct(back, kRatio)) continue;
    const int second = std::max(there.second, back.second);
    matches.push_back({static_cast<int>(i), there.index,
                       DescriptorAngle(there.dot) / std::max(DescriptorAngle(second), 1e-6f)});
  }
  std::stable_sort(matches.begin(), matches.end(),
                   [](const CoarseMatch& m, const CoarseMatch& n) { return m.ratio < n.ratio; });
  return matches;
}

std::vector<std::pair<int, int>> ChoosePairs(std::span<const MatchPhoto> photos,
                                             const MatchOptions& options, Progress& progress) {
  const int count = static_cast<int>(photos.size());
  if (options.pairs) Check(*options.pairs, count);
  if (!options.preselect) return options.pairs ? *options.pairs : AllPairs(count);
  const auto candidates = Candidates(photos, options, progress);
  const std::vector<int> scores = ScoresOf(photos, candidates, options, progress);
  std::set<std::pair<int, int>> pairs;
  std::vector<std::vector<std::pair<int, int>>> scored(photos.size());
  for (size_t k = 0; k < candidates.size(); ++k) {
    const auto [a, b] = candidates[k];
    if (b == a + 1) pairs.emplace(a, b);
    scored[static_cast<size_t>(a)].emplace_back(b, scores[k]);
    scored[static_cast<size_t>(b)].emplace_back(a, scores[k]);
  }
  for (int a = 0; a < count; ++a) {
    for (const int b : PartnersOf(std::move(scored[static_cast<size_t>(a)]))) {
      pairs.emplace(std::min(a, b), std::max(a, b));
    }
  }
  return {pairs.begin(), pairs.end()};
}

}  // namespace dtr::sfm::matching
