#include "dtr/base/order_statistics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "dtr/base/random.h"

namespace dtr {
namespace {

TEST(OrderStatistics, AreTheElementsOfASortedVector) {
  Random random(3);
  for (int count = 1; count < 12; ++count) {
    std::vector<double> values;
    for (int i = 0; i < count; ++i) values.push_back(random.Index(6));  // some are equal
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(UpperMedian(values), sorted[sorted.size() / 2]);
    EXPECT_EQ(QuantileOf(values, 0), sorted.front());
    EXPECT_EQ(QuantileOf(values, 1), sorted.back());
    EXPECT_EQ(QuantileOf(values, 0.5), sorted[(sorted.size() - 1) / 2]);
  }
}

TEST(OrderStatistics, OfPositiveValuesAreThoseOfASortedVectorOfThem) {
  Random random(4);
  const std::array shares{0.0, 0.005, 0.5, 0.995, 1.0};
  for (const int count : {1, 2, 7, 5000}) {
    std::vector<float> values, sorted;
    for (int i = 0; i < count; ++i) {
      // From the smallest to the largest that float32 knows, some equal, some not positive.
      const auto value = static_cast<float>(std::exp(random.Uniform(-100, 88)));
      values.push_back(i % 5 == 4 ? values.back() : value);
      sorted.push_back(values.back());
      values.insert(values.end(), {0.0f, -value, std::numeric_limits<float>::quiet_NaN()});
      std::swap(values[values.size() - 4], values.back());
    }
    std::sort(sorted.begin(), sorted.end());
    const std::vector<float> found = QuantilesOfPositive(values, shares);
    ASSERT_EQ(found.size(), shares.size());
    for (size_t k = 0; k < shares.size(); ++k) {
      const double rank = shares[k] * static_cast<double>(sorted.size() - 1);
      EXPECT_EQ(found[k], sorted[static_cast<size_t>(rank)]) << count << " values, " << shares[k];
    }
  }
  EXPECT_TRUE(QuantilesOfPositive(std::array{0.0f, -1.0f}, shares).empty());
}

}  // namespace
}  // namespace dtr
