#include "dtr/base/order_statistics.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace dtr
