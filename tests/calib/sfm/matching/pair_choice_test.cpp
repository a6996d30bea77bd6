#include "calib/sfm/matching/pair_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "calib/sfm/matching/photo_index.h"
#include "calib/sfm/matching/vocabulary.h"
#include "tests/calib/sfm/matching/match_world.h"

namespace dtr::sfm::matching {
namespace {

constexpr int kPhotos = 160;
constexpr int kSeen = 120;  // descriptors of a photo
constexpr int kStep = 15;   // of which this many leave its image with every step of the walk

std::array<double, 128> RandomLook(Random& random) {
  std::array<double, 128> look;
  for (double& value : look) value = std::max(0.0, random.Normal());
  return look;
}

// A walk along a wall: photo i shows kSeen points from kStep * i on, each with noise.
std::vector<std::vector<Descriptor>> Walk(double noise, std::uint64_t seed) {
  Random random(seed);
  std::vector<std::array<double, 128>> looks(kStep * kPhotos + kSeen);
  for (auto& look : looks) look = RandomLook(random);
  std::vector<std::vector<Descriptor>> photos(kPhotos);
  for (int i = 0; i < kPhotos; ++i) {
    for (int k = 0; k < kSeen; ++k) {
      photos[static_cast<size_t>(i)].push_back(
          Near(looks[static_cast<size_t>(kStep * i + k)], noise, random));
    }
  }
  return photos;
}

std::vector<MatchPhoto> PhotosOf(const std::vector<std::vector<Descriptor>>& descriptors) {
  std::vector<MatchPhoto> photos;
  for (const auto& of_photo : descriptors) {
    MatchPhoto photo{"photo" + std::to_string(photos.size()), 1000, 750, 0, {}};
    photo.features.keypoints.resize(of_photo.size());
    photo.features.descriptors = of_photo;
    photos.push_back(std::move(photo));
  }
  return photos;
}

TEST(Vocabulary, WordsAreWhatLooksAlike) {
  Random random(3);
  std::vector<Descriptor> sample;
  std::vector<int> kind;
  for (int k = 0; k < 40; ++k) {
    const auto look = RandomLook(random);
    for (int i = 0; i < 30; ++i) {
      sample.push_back(Near(look, 0.1, random));
      kind.push_back(k);
    }
  }
  const Vocabulary vocabulary(sample, 40, 1);
  EXPECT_GE(vocabulary.Size(), 20u);
  EXPECT_LE(vocabulary.Size(), 60u);
  const std::vector<int> words = vocabulary.WordsOf(sample);
  int apart = 0;
  for (size_t i = 0; i + 1 < words.size(); ++i) {
    ASSERT_GE(words[i], 0);
    ASSERT_LT(words[i], static_cast<int>(vocabulary.Size()));
    apart += kind[i] == kind[i + 1] && words[i] != words[i + 1];
  }
  EXPECT_LT(apart, 60);  // of 1160: k-means may cut a few kinds in two
  const ThreadLimit limit(3);
  EXPECT_EQ(Vocabulary(sample, 40, 1).WordsOf(sample), words);
}

TEST(Vocabulary, NothingAndOneDescriptorAreWords) {
  EXPECT_TRUE(Vocabulary({}, 10, 1).WordsOf({}).empty());
  const std::vector<Descriptor> one{Descriptor{}};
  EXPECT_EQ(Vocabulary(one, 0, 1).WordsOf(one), std::vector<int>{0});
}

TEST(PhotoIndex, RanksNeighboursOfAWalkFirst) {
  const auto descriptors = Walk(0.25, 5);
  SilentProgress progress;
  const auto of = [&](int i) { return descriptors[static_cast<size_t>(i)]; };
  const PhotoIndex index(kPhotos, of, 1, progress);
  const ThreadLimit limit(1);
  const PhotoIndex again(kPhotos, of, 1, progress);
  int found = 0, all = 0;
  for (int a = 0; a < kPhotos; ++a) {
    const std::vector<float> scores = index.ScoresOf(a);
    EXPECT_EQ(scores, again.ScoresOf(a));
    EXPECT_EQ(scores[static_cast<size_t>(a)], 0);
    std::vector<int> order(kPhotos);
    for (int b = 0; b < kPhotos; ++b) order[static_cast<size_t>(b)] = b;
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
      return scores[static_cast<size_t>(i)] > scores[static_cast<size_t>(j)];
    });
    for (int b = std::max(0, a - 4); b <= std::min(kPhotos - 1, a + 4); ++b) {
      if (b == a) continue;
      ++all;
      found += std::find(order.begin(), order.begin() + 10, b) != order.begin() + 10;
    }
  }
  EXPECT_GT(found, 0.97 * all);
}

TEST(PhotoIndex, WhatIsInEveryPhotoTellsNoneFromAnother) {
  SilentProgress progress;
  Random random(2);
  const auto look = RandomLook(random);
  std::vector<Descriptor> same;
  for (int k = 0; k < 20; ++k) same.push_back(Near(look, 0.0, random));
  const PhotoIndex index(
      100, [&](int) { return same; }, 1, progress);
  for (const float score : index.ScoresOf(7)) EXPECT_EQ(score, 0);
  const PhotoIndex empty(
      3, [](int) { return std::vector<Descriptor>{}; }, 1, progress);
  EXPECT_EQ(empty.ScoresOf(1), std::vector<float>(3, 0));
}

TEST(ChoosePairs, AnIndexLosesNoNeighbourOfManyPhotos) {
  const auto photos = PhotosOf(Walk(0.25, 9));
  MatchOptions options;
  options.preselect = true;
  SilentProgress progress;
  const auto pairs = ChoosePairs(photos, options, progress);
  EXPECT_TRUE(std::is_sorted(pairs.begin(), pairs.end()));
  EXPECT_LE(pairs.size(), kPhotos * (kPartners + 1));
  for (int a = 0; a < kPhotos; ++a) {
    for (int b = a + 1; b <= std::min(kPhotos - 1, a + 4); ++b) {
      EXPECT_TRUE(std::binary_search(pairs.begin(), pairs.end(), std::pair(a, b))) << a << " " << b;
    }
  }
  const ThreadLimit limit(3);
  EXPECT_EQ(ChoosePairs(photos, options, progress), pairs);
}

TEST(ChoosePairs, NoPairThatIsNotAllowed) {
  const auto photos = PhotosOf(Walk(0.25, 9));
  MatchOptions options;
  options.preselect = true;
  options.pairs.emplace();
  for (int a = 0; a < kPhotos; ++a) {
    for (int b = a + 1; b < kPhotos; ++b) {
      if ((b - a) % 3 != 0) options.pairs->emplace_back(a, b);  // more than an index looks at
    }
  }
  SilentProgress progress;
  const auto pairs = ChoosePairs(photos, options, progress);
  for (const auto& [a, b] : pairs) EXPECT_NE((b - a) % 3, 0);
  EXPECT_TRUE(std::binary_search(pairs.begin(), pairs.end(), std::pair(3, 5)));
  options.pairs->emplace_back(5, kPhotos);
  EXPECT_THROW(ChoosePairs(photos, options, progress), std::invalid_argument);
}

}  // namespace
}  // namespace dtr::sfm::matching
