// calib/sfm/matching/photo_blocks.h -- pairs of photos in blocks whose photos fit into memory.
#pragma once
#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr::sfm::matching {

/// The end of the block that begins with pair `begin`: at most `max_pairs` pairs, whose photos take
/// at most `max_bytes` (0: no bound) together; one pair at least. `bytes`: of each photo.
inline size_t BlockEnd(std::span<const std::pair<int, int>> pairs, size_t begin,
                       std::span<const double> bytes, double max_bytes, size_t max_pairs) {
  std::set<int> photos;
  double used = 0;
  size_t end = begin;
  for (; end < pairs.size() && end - begin < max_pairs; ++end) {
    for (const int photo : {pairs[end].first, pairs[end].second}) {
      if (photos.insert(photo).second) used += bytes[static_cast<size_t>(photo)];
    }
    if (max_bytes > 0 && used > max_bytes && end > begin) break;
  }
  return end;
}

/// What is in memory of photos.
template <typename T>
class PhotoCache {
 public:
  PhotoCache(size_t photos, std::function<T(int)> load) : load_(std::move(load)), loaded_(photos) {}

  /// Drops the photos that these pairs do not need and loads those that are missing.
  void Require(std::span<const std::pair<int, int>> pairs) {
    std::vector<bool> needed(loaded_.size(), false);
    for (const auto& [a, b] : pairs) {
      needed[static_cast<size_t>(a)] = needed[static_cast<size_t>(b)] = true;
    }
    std::vector<int> missing;
    for (size_t i = 0; i < needed.size(); ++i) {
      if (!needed[i]) loaded_[i].reset();
      if (needed[i] && !loaded_[i]) missing.push_back(static_cast<int>(i));
    }
    ParallelFor(0, static_cast<int>(missing.size()), [&](int k) {
      const int photo = missing[static_cast<size_t>(k)];
      loaded_[static_cast<size_t>(photo)].emplace(load_(photo));
    });
  }

  const T& operator[](int photo) const { return *loaded_[static_cast<size_t>(photo)]; }

 private:
  std::function<T(int)> load_;
  std::vector<std::optional<T>> loaded_;
};

}  // namespace dtr::sfm::matching
