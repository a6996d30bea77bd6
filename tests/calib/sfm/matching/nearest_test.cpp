#include "calib/sfm/matching/nearest.h"

#include <gtest/gtest.h>

#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

std::vector<Descriptor> Descriptors(size_t count, std::uint64_t seed, int most) {
  Random random(seed);
  std::vector<Descriptor> all(count);
  for (Descriptor& d : all) {
    for (auto& value : d) value = static_cast<std::uint8_t>(random.Index(most + 1));
  }
  return all;
}

int Dot(const Descriptor& a, const Descriptor& b) {
  int sum = 0;
  for (size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

std::vector<Nearest> Naive(const std::vector<Descriptor>& a, const std::vector<Descriptor>& b) {
  std::vector<Nearest> all;
  for (const Descriptor& d : a) {
    Nearest nearest{-1, -1, -1};
    for (size_t j = 0; j < b.size(); ++j) {
      const int dot = Dot(d, b[j]);
      if (dot > nearest.dot) {
        nearest = {static_cast<int>(j), dot, nearest.dot};
      } else {
        nearest.second = std::max(nearest.second, dot);
      }
    }
    all.push_back(nearest);
  }
  return all;
}

void ExpectSame(const std::vector<Nearest>& found, const std::vector<Nearest>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].index, expected[i].index) << i;
    EXPECT_EQ(found[i].dot, expected[i].dot) << i;
    EXPECT_EQ(found[i].second, expected[i].second) << i;
  }
}

TEST(SfmNearest, IsThatOfANaiveLoopForAnyNumbersOfFeatures) {
  for (const auto& [a_count, b_count] :
       {std::pair<size_t, size_t>{1, 1}, {1, 2}, {5, 17}, {37, 8}, {70, 95}}) {
    // Few values of elements: many dot products are the same.
    for (const int most : {1, 255}) {
      const auto a = Descriptors(a_count, 1, most), b = Descriptors(b_count, 2, most);
      const NearestBothWays nearest = FindNearest(a, b);
      ExpectSame(nearest.of_a, Naive(a, b));
      ExpectSame(nearest.of_b, Naive(b, a));
    }
  }
}

TEST(SfmNearest, NothingIsNearestToNothing) {
  const auto some = Descriptors(3, 1, 255);
  const NearestBothWays nearest = FindNearest(some, {});
  ASSERT_EQ(nearest.of_a.size(), 3u);
  EXPECT_EQ(nearest.of_a[0].index, -1);
  EXPECT_TRUE(nearest.of_b.empty());
}

TEST(SfmNearest, DotProductsOfTheLargestBytesAreExact) {
  Descriptor full;
  full.fill(255);
  const auto rows = Descriptors(9, 3, 255);
  const std::vector<int> chosen = {8, 0, 3};
  std::vector<int> dots(chosen.size());
  DotProducts(full, rows, chosen, dots);
  for (size_t i = 0; i < chosen.size(); ++i) {
    EXPECT_EQ(dots[i], Dot(full, rows[static_cast<size_t>(chosen[i])]));
  }
  EXPECT_EQ(FindNearest(std::vector{full}, std::vector{full}).of_a[0].dot, 128 * 255 * 255);
}

}  // namespace
}  // namespace dtr::sfm::matching
