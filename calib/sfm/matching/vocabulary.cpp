#include "calib/sfm/matching/vocabulary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "calib/sfm/matching/nearest.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr int kIterations = 6;
constexpr size_t kChunk = 1024;  // descriptors that are assigned at once
constexpr size_t kMaxTop = 256;

std::vector<int> NearestCentre(std::span<const Descriptor> descriptors,
                               std::span<const Descriptor> centres) {
  std::vector<int> nearest;
  nearest.reserve(descriptors.size());
  for (const Nearest& n : FindNearest(descriptors, centres).of_a) nearest.push_back(n.index);
  return nearest;
}

std::vector<int> NearestCentreInChunks(std::span<const Descriptor> descriptors,
                                       std::span<const Descriptor> centres) {
  std::vector<int> nearest(descriptors.size());
  const size_t chunks = (descriptors.size() + kChunk - 1) / kChunk;
  ParallelFor(0, static_cast<int>(chunks), [&](int chunk) {
    const size_t begin = static_cast<size_t>(chunk) * kChunk;
    const auto some = descriptors.subspan(begin, std::min(kChunk, descriptors.size() - begin));
    const std::vector<int> found = NearestCentre(some, centres);
    std::copy(found.begin(), found.end(), nearest.begin() + static_cast<std::ptrdiff_t>(begin));
  });
  return nearest;
}

// The direction of a sum of descriptors, as a descriptor: of length 512 but for rounding.
Descriptor DirectionOf(const std::array<std::int64_t, 128>& sum) {
  double squares = 0;
  for (const std::int64_t s : sum) squares += static_cast<double>(s) * static_cast<double>(s);
  Descriptor direction;
  for (size_t k = 0; k < sum.size(); ++k) {
    const double value = 512 * static_cast<double>(sum[k]) / std::max(std::sqrt(squares), 1.0);
    direction[k] = static_cast<std::uint8_t>(std::min(255L, std::lround(value)));
  }
  return direction;
}

// k-means on the sphere. A centre that loses all of its descriptors stays where it was.
std::vector<Descriptor> CentresOf(std::span<const Descriptor> sample, size_t count,
                                  std::uint64_t seed) {
  count = std::clamp<size_t>(count, 1, std::max<size_t>(sample.size(), 1));
  std::vector<size_t> order(sample.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return std::pair(HashOf(seed, a), a) < std::pair(HashOf(seed, b), b);
  });
  std::vector<Descriptor> centres;
  for (size_t k = 0; k < std::min(count, order.size()); ++k) centres.push_back(sample[order[k]]);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const std::vector<int> nearest = NearestCentreInChunks(sample, centres);
    std::vector<std::array<std::int64_t, 128>> sums(centres.size());
    std::vector<bool> is_used(centres.size());
    for (size_t i = 0; i < sample.size(); ++i) {
      const auto centre = static_cast<size_t>(nearest[i]);
      is_used[centre] = true;
      for (size_t k = 0; k < sample[i].size(); ++k) sums[centre][k] += sample[i][k];
    }
    for (size_t c = 0; c < centres.size(); ++c) {
      if (is_used[c]) centres[c] = DirectionOf(sums[c]);
    }
  }
  return centres;
}

// Descriptors by the centre nearest to each, in order.
std::vector<std::vector<Descriptor>> Grouped(std::span<const Descriptor> descriptors,
                                             const std::vector<int>& nearest, size_t centres) {
  std::vector<std::vector<Descriptor>> groups(centres);
  for (size_t i = 0; i < descriptors.size(); ++i) {
    groups[static_cast<size_t>(nearest[i])].push_back(descriptors[i]);
  }
  return groups;
}

}  // namespace

Vocabulary::Vocabulary(std::span<const Descriptor> sample, size_t words, std::uint64_t seed) {
  const auto root = static_cast<size_t>(std::lround(std::sqrt(static_cast<double>(words))));
  top_ = CentresOf(sample, std::clamp<size_t>(root, 1, kMaxTop), seed);
  const auto groups = Grouped(sample, NearestCentreInChunks(sample, top_), top_.size());
  below_.resize(top_.size());
  ParallelFor(0, static_cast<int>(top_.size()), [&](int c) {
    const auto& group = groups[static_cast<size_t>(c)];
    // Words are as many as descriptors are: where they are dense, words are close.
    const double part = static_cast<double>(group.size()) / static_cast<double>(sample.size());
    const auto count = static_cast<size_t>(std::lround(part * static_cast<double>(words)));
    below_[static_cast<size_t>(c)] =
        CentresOf(group, count, HashOf(seed, static_cast<std::uint64_t>(c)));
  });
  for (const auto& centres : below_) {
    first_word_.push_back(static_cast<int>(size_));
    size_ += std::max<size_t>(centres.size(), 1);
  }
}

std::vector<int> Vocabulary::WordsOf(std::span<const Descriptor> descriptors) const {
  std::vector<int> words = NearestCentre(descriptors, top_);
  std::vector<std::vector<size_t>> members(top_.size());
  for (size_t i = 0; i < words.size(); ++i) members[static_cast<size_t>(words[i])].push_back(i);
  for (size_t c = 0; c < members.size(); ++c) {
    std::vector<Descriptor> group;
    for (const size_t i : members[c]) group.push_back(descriptors[i]);
    std::vector<int> within(group.size(), 0);
    if (below_[c].size() > 1) within = NearestCentre(group, below_[c]);
    for (size_t k = 0; k < group.size(); ++k) words[members[c][k]] = first_word_[c] + within[k];
  }
  return words;
}

}  // namespace dtr::sfm::matching
