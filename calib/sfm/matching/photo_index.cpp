#include "calib/sfm/matching/photo_index.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "calib/sfm/matching/nearest.h"
#include "calib/sfm/matching/vocabulary.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr float kRatio = 0.8f;   // Lowe's
constexpr size_t kPerWord = 64;  // descriptors, in the mean
constexpr size_t kSamples = 16;  // of a word, that it is learnt from
// A word of more descriptors is a stop word: what is everywhere tells no photo from another.
constexpr size_t kStopWord = 1024;
constexpr float kLengthSquared = 512.0f * 512.0f;

}  // namespace

PhotoIndex::PhotoIndex(int photos,
                       const std::function<std::vector<Descriptor>(int)>& descriptors_of,
                       std::uint64_t seed, Progress& progress)
    : of_photo_(static_cast<size_t>(photos)) {
  std::vector<std::vector<Descriptor>> all(static_cast<size_t>(photos));
  progress.Stage("indexing photos", 2 * photos);
  std::atomic<int> done = 0;
  ParallelFor(0, photos, [&](int i) {
    progress.ThrowIfInterrupted();
    all[static_cast<size_t>(i)] = descriptors_of(i);
    progress.Update(++done);
  });
  const size_t total =
      std::accumulate(all.begin(), all.end(), size_t{0},
                      [](size_t sum, const auto& descriptors) { return sum + descriptors.size(); });
  std::vector<Descriptor> sample;
  for (size_t i = 0; i < all.size(); ++i) {
    for (size_t k = 0; k < all[i].size(); ++k) {
      if (HashOf(seed, i, k) % kPerWord < kSamples) sample.push_back(all[i][k]);
    }
  }
  const Vocabulary vocabulary(sample, total / kPerWord, seed);
  std::vector<std::vector<int>> words(all.size());
  ParallelFor(0, photos, [&](int i) {
    progress.ThrowIfInterrupted();
    words[static_cast<size_t>(i)] = vocabulary.WordsOf(all[static_cast<size_t>(i)]);
    progress.Update(++done);
  });
  in_word_.resize(vocabulary.Size());
  photo_in_word_.resize(vocabulary.Size());
  for (size_t i = 0; i < all.size(); ++i) {
    for (size_t k = 0; k < all[i].size(); ++k) {
      const auto word = static_cast<size_t>(words[i][k]);
      of_photo_[i].push_back({words[i][k], static_cast<int>(in_word_[word].size())});
      in_word_[word].push_back(all[i][k]);
      photo_in_word_[word].push_back(static_cast<int>(i));
    }
    all[i] = {};
  }
}

std::vector<float> PhotoIndex::ScoresOf(int photo) const {
  std::vector<float> scores(of_photo_.size(), 0);
  std::vector<int> everything, dots, sorted;
  std::vector<int> having;  // photos that have the descriptor
  for (const Place& place : of_photo_[static_cast<size_t>(photo)]) {
    const auto& descriptors = in_word_[static_cast<size_t>(place.word)];
    const auto& owners = photo_in_word_[static_cast<size_t>(place.word)];
    if (descriptors.size() > kStopWord) continue;
    everything.resize(descriptors.size());
    std::iota(everything.begin(), everything.end(), 0);
    dots.resize(descriptors.size());
    DotProducts(descriptors[static_cast<size_t>(place.at)], descriptors, everything, dots);
    sorted = dots;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const float least = kLengthSquared * std::cos(kRatio * DescriptorAngle(*middle));
    having.clear();
    for (size_t k = 0; k < dots.size(); ++k) {
      const bool is_new = having.empty() || having.back() != owners[k];
      if (is_new && owners[k] != photo && static_cast<float>(dots[k]) > least) {
        having.push_back(owners[k]);
      }
    }
    if (having.empty()) continue;
    const float weight =
        std::log(static_cast<float>(scores.size()) / static_cast<float>(having.size()));
    for (const int other : having) scores[static_cast<size_t>(other)] += weight;
  }
  return scores;
}

}  // namespace dtr::sfm::matching
