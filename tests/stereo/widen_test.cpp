// Ranges that are too narrow, and ranges that are not.
#include "stereo/widen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "datasets/exact/stereo_quality.h"
#include "stereo/depth_maps.h"
#include "tests/support/noted_lines.h"

namespace dtr::stereo::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const PinholeCamera kCamera(320, 240, 300, 300, 160, 120);

/// Three views of a slanted plane that lies between the depths 2.5 and 8.1.
class WidenedRanges : public ::testing::Test {
 protected:
  WidenedRanges() {
    for (int i = 0; i < 3; ++i) {
      shots_.push_back(Photograph(Slanted(), kCamera, Facing({0.3 * i, 0.05 * i, 0}), 0.35));
    }
    views_ = ViewsOf(shots_);
    for (int v = 0; v < 3; ++v) {
      neighbours_.push_back({});
      for (int n = 0; n < 3; ++n) {
        if (n != v) neighbours_.back().views.push_back(n);
      }
    }
  }
  std::vector<DepthRange> Widen(const DepthRange& range, int most) {
    const std::vector<DepthRange> ranges(views_.size(), range);
    Pages pages;
    return Widened({views_, neighbours_, ranges, engine_.get(), {}, {}, &pages}, most, notes_);
  }
  std::pair<double, double> TrueRange() const {
    double near_z = 1e9, far_z = 0;
    for (const Shot& shot : shots_) {
      for (const float z : shot.truth.grid().data()) {
        near_z = std::min<double>(near_z, z);
        far_z = std::max<double>(far_z, z);
      }
    }
    return {near_z, far_z};
  }

  std::unique_ptr<Engine> engine_ = MakeEngine("patchmatch");
  std::vector<Shot> shots_;
  std::vector<StereoView> views_;
  std::vector<ViewNeighbours> neighbours_;
  dtr::testing::NotedLines notes_;
};

TEST_F(WidenedRanges, AnEndThatDepthsPileUpAtMovesOutUntilTheyDoNot) {
  const auto [near_z, far_z] = TrueRange();
  for (const DepthRange& r : Widen({1.3 * near_z, 1.5 * far_z}, 3)) {
    EXPECT_LT(r.near_z, near_z);
    EXPECT_EQ(r.far_z, 1.5 * far_z);
  }
  ASSERT_THAT(notes_.lines, SizeIs(1));
  EXPECT_THAT(notes_.lines[0], HasSubstr("widened in 3 of 3 views, in 3 at the near end, in 0"));
  notes_.lines.clear();
  for (const DepthRange& r : Widen({near_z / 1.3, 0.75 * far_z}, 3)) {
    EXPECT_EQ(r.near_z, near_z / 1.3);
    EXPECT_GT(r.far_z, far_z);
  }
  ASSERT_THAT(notes_.lines, SizeIs(1));
  EXPECT_THAT(notes_.lines[0], HasSubstr("in 0 at the near end, in 3 at the far one"));
}

TEST_F(WidenedRanges, ARangeThatHoldsTheSceneStaysAsItIs) {
  const auto [near_z, far_z] = TrueRange();
  for (const DepthRange& r : Widen({near_z / 1.3, 1.5 * far_z}, 3)) {
    EXPECT_EQ(r.near_z, near_z / 1.3);
    EXPECT_EQ(r.far_z, 1.5 * far_z);
  }
  EXPECT_THAT(notes_.lines, IsEmpty());
}

TEST_F(WidenedRanges, ItStopsAfterSoManySteps) {
  const auto [near_z, far_z] = TrueRange();
  for (const DepthRange& r : Widen({2 * near_z, 1.5 * far_z}, 1)) {
    EXPECT_GE(r.near_z, 2 * near_z / 1.5 - 1e-12);
  }
  for (const DepthRange& r : Widen({1.3 * near_z, 1.5 * far_z}, 0)) {
    EXPECT_EQ(r.near_z, 1.3 * near_z);
  }
}

TEST(SharesAtEnds, CountWhatIsKeptWithin3PerCentOfAnEnd) {
  DepthImage depth(4, 2);
  const float z[] = {1.0f, 1.02f, 1.1f, 5.0f, 9.9f, 0.0f, 0.0f, 5.0f};
  std::copy(std::begin(z), std::end(z), depth.grid().data().begin());
  const EndShares shares = SharesAtEnds(depth, {1, 10});
  EXPECT_DOUBLE_EQ(shares.at_near, 2.0 / 6);
  EXPECT_DOUBLE_EQ(shares.at_far, 1.0 / 6);
  EXPECT_EQ(SharesAtEnds(DepthImage(3, 3), {1, 10}).at_near, 0);
}

}  // namespace
}  // namespace dtr::stereo::testing
