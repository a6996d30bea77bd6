#include "calib/sfm/matching/pair_choice.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>

#include "calib/sfm/matching/nearest.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm::matching {
namespace {

constexpr float kRatio = 0.8f;       // Lowe's
constexpr size_t kGlance = 300;      // features of a photo that tell whether photos overlap
constexpr size_t kNearestKept = 12;  // of the partners, by rank; the others are spread

std::vector<int> PartnersOf(const std::vector<int>& scores) {
  std::vector<int> order(scores.size());
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](int i) { return scores[static_cast<size_t>(i)] <= 0; });
  std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
    return scores[static_cast<size_t>(i)] > scores[static_cast<size_t>(j)];
  });
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

std::vector<std::pair<int, int>> AllowedPairs(int photos, const MatchOptions& options) {
  std::vector<std::pair<int, int>> pairs;
  if (options.pairs) {
    for (const auto& [a, b] : *options.pairs) {
      if (a < 0 || b >= photos || a >= b)
        throw std::invalid_argument("MatchPhotos: a pair of no two photos");
    }
    return *options.pairs;
  }
  for (int a = 0; a < photos; ++a) {
    for (int b = a + 1; b < photos; ++b) pairs.emplace_back(a, b);
  }
  return pairs;
}

// Matches among the largest features, per photo and other photo; 0 of pairs that are not allowed.
std::vector<std::vector<int>> ScoresOf(std::span<const MatchPhoto> photos,
                                       const std::vector<std::pair<int, int>>& allowed,
                                       const MatchOptions& options, Progress& progress) {
  std::vector<std::vector<int>> scores(photos.size(), std::vector<int>(photos.size(), 0));
  constexpr int kPairsAtOnce = 256;
  const int count = static_cast<int>(allowed.size());
  const int chunks = (count + kPairsAtOnce - 1) / kPairsAtOnce;
  progress.Stage("comparing photos", chunks);
  std::vector<LoadedDescriptors> largest(photos.size());
  ParallelFor(0, static_cast<int>(photos.size()), options.threads, [&](int i) {
    largest[static_cast<size_t>(i)] = DescriptorsOf(photos, i, kGlance, options);
  });
  std::atomic<int> done = 0;
  ParallelFor(0, chunks, options.threads, [&](int chunk) {
    progress.ThrowIfInterrupted();
    for (int k = chunk * kPairsAtOnce; k < std::min(count, (chunk + 1) * kPairsAtOnce); ++k) {
      const auto [a, b] = allowed[static_cast<size_t>(k)];
      const auto i = static_cast<size_t>(a), j = static_cast<size_t>(b);
      scores[i][j] = scores[j][i] =
          static_cast<int>(CoarseMatches(largest[i].all, largest[j].all).size());
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
  const std::vector<std::pair<int, int>> allowed = AllowedPairs(count, options);
  if (!options.preselect) return allowed;
  const auto scores = ScoresOf(photos, allowed, options, progress);
  std::set<std::pair<int, int>> pairs;
  for (const auto& [a, b] : allowed) {
    if (b == a + 1) pairs.emplace(a, b);
  }
  for (int a = 0; a < count; ++a) {
    for (const int b : PartnersOf(scores[static_cast<size_t>(a)])) {
      pairs.emplace(std::min(a, b), std::max(a, b));
    }
  }
  return {pairs.begin(), pairs.end()};
}

}  // namespace dtr::sfm::matching
