#include "viewer/labels.h"

#include <gtest/gtest.h>

namespace dtr::viewer {
namespace {

PlacedName At(double distance, double left, double top) {
  return {distance, {Eigen::Vector2d(left, top), Eigen::Vector2d(left + 10, top + 4)}};
}

TEST(LegibleNames, TheNearestIsWrittenAndWhatLiesOnItIsNot) {
  const std::vector<PlacedName> names = {At(3, 0, 0), At(1, 5, 2), At(2, 40, 0), At(4, 8, 3)};
  EXPECT_EQ(LegibleNames(names), (std::vector<size_t>{1, 2}));
}

// What a name would have hidden is free again where that name is not written itself.
TEST(LegibleNames, AnUnwrittenNameHidesNothing) {
  const std::vector<PlacedName> names = {At(1, 0, 0), At(2, 8, 0), At(3, 16, 0)};
  EXPECT_EQ(LegibleNames(names), (std::vector<size_t>{0, 2}));
}

TEST(LegibleNames, BoxesThatTouchAreBothLegibleAndOfEquallyNearOnesTheFirstIsWritten) {
  const std::vector<PlacedName> touching = {At(1, 0, 0), At(1, 10, 0), At(1, 0, 4), At(1, 9, 3)};
  EXPECT_EQ(LegibleNames(touching), (std::vector<size_t>{0, 1, 2}));
  const std::vector<PlacedName> same = {At(1, 0, 0), At(1, 0, 0)};
  EXPECT_EQ(LegibleNames(same), (std::vector<size_t>{0}));
  EXPECT_TRUE(LegibleNames({}).empty());
}

}  // namespace
}  // namespace dtr::viewer
