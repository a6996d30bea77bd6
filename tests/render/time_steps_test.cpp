#include "dtr/render/time_steps.h"

#include <gtest/gtest.h>

#include "dtr/base/error.h"

namespace dtr {
namespace {

DtrSet SetAt(const std::vector<double>& times_s) {
  DtrSet set;
  set.sparse_file.emplace();
  for (const double time_s : times_s) {
    Frame& frame = set.frames.emplace_back();
    frame.time_s = time_s;
    frame.views.resize(1);
    frame.views[0].image = ImageRgb8(2, 2, 3);
  }
  return set;
}

TEST(FrameClock, AFrameLastsUntilTheNextOnesTime) {
  const FrameClock clock(SetAt({3, 3.5, 5}));
  EXPECT_EQ(clock.frames(), 3u);
  EXPECT_EQ(clock.StartOf(0), 0);
  EXPECT_EQ(clock.StartOf(2), 2);
  EXPECT_EQ(clock.period_s(), 3);  // the last lasts 1 s, as the others on average
  const std::pair<double, size_t> expected[] = {{0, 0},    {0.49, 0}, {0.5, 1}, {1.99, 1},
                                                {2, 2},    {2.99, 2}, {3, 0},   {303.5, 1},
                                                {-0.5, 2}, {-1.5, 1}};
  for (const auto& [seconds, frame] : expected) EXPECT_EQ(clock.FrameAt(seconds), frame) << seconds;
}

TEST(FrameClock, FramesWithoutTimesLastAlike) {
  for (const auto& times : {std::vector<double>{0, 0, 0}, {2, 1, 0}, {0, 1, 1}}) {
    const FrameClock clock(SetAt(times));
    const double one = 1 / FrameClock::kUntimedPerSecond;
    EXPECT_NEAR(clock.period_s(), 3 * one, 1e-12);
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(clock.FrameAt((static_cast<double>(i) + 0.5) * one), i);
      EXPECT_EQ(clock.FrameAt(clock.StartOf(i)), i);
    }
  }
}

TEST(FrameClock, AStillSceneStandsStill) {
  for (const FrameClock& clock : {FrameClock(), FrameClock(SetAt({7}))}) {
    EXPECT_EQ(clock.frames(), 1u);
    for (const double seconds : {-1.0, 0.0, 0.3, 1e9}) EXPECT_EQ(clock.FrameAt(seconds), 0u);
  }
}

TEST(SplitFrames, GivesWhatAtFrameGivesWithoutCopyingPixels) {
  DtrSet set = SetAt({0, 1});
  const std::uint8_t* const pixels = set.frames[1].views[0].image.data().data();
  const DtrSet second = AtFrame(set, 1);
  std::vector<DtrSet> stills = SplitFrames(std::move(set));
  ASSERT_EQ(stills.size(), 2u);
  EXPECT_TRUE(stills[0].sparse_file.has_value());
  EXPECT_FALSE(stills[1].sparse_file.has_value());
  EXPECT_FALSE(second.sparse_file.has_value());
  ASSERT_EQ(stills[1].frames.size(), 1u);
  EXPECT_EQ(stills[1].frames[0].time_s, second.frames[0].time_s);
  EXPECT_EQ(stills[1].frames[0].views[0].image.data().data(), pixels);
}

}  // namespace
}  // namespace dtr
