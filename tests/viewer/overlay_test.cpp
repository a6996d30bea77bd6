#include "viewer/overlay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

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

TEST(MayBeLaidOver, NotWhereMostOfThePictureWouldBeHidden) {
  const Eigen::Vector2d display(1280, 800);
  const auto centred = [&](double share) {
    const Eigen::Vector2d half = 0.5 * std::sqrt(share) * display, middle = 0.5 * display;
    return std::array<Eigen::Vector2d, 4>{
        middle - half, middle + Eigen::Vector2d(half.x(), -half.y()), middle + half,
        middle + Eigen::Vector2d(-half.x(), half.y())};
  };
  EXPECT_TRUE(MayBeLaidOver(centred(0.02), display));
  EXPECT_TRUE(MayBeLaidOver(centred(0.24), display));
  EXPECT_FALSE(MayBeLaidOver(centred(0.26), display));
  EXPECT_FALSE(MayBeLaidOver(centred(1), display)) << "the camera one stands at";
  auto seen_from_behind = centred(1);
  std::swap(seen_from_behind[1], seen_from_behind[3]);
  EXPECT_FALSE(MayBeLaidOver(seen_from_behind, display));
}

}  // namespace
}  // namespace dtr::viewer
