#include "viewer/time_player.h"

#include <gtest/gtest.h>

namespace dtr::viewer {
namespace {

/// Four time steps of 0.25 s.
FrameClock Quarters() {
  DtrSet set;
  for (const double time_s : {10.0, 10.25, 10.5, 10.75}) set.frames.emplace_back().time_s = time_s;
  return FrameClock(set);
}

TEST(TimePlayer, ShowsEachTimeStepForAsLongAsItLasts) {
  const FrameClock clock = Quarters();
  TimePlayer player;
  EXPECT_EQ(player.Advance(0.1, clock, 2), 2u) << "it stands still";
  player.StartOrStop();
  size_t shown = 2;
  std::vector<size_t> seen;
  for (int i = 0; i < 20; ++i) seen.push_back(shown = player.Advance(1.0 / 16, clock, shown));
  EXPECT_EQ(seen,
            (std::vector<size_t>{2, 2, 2, 3, 3, 3, 3, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3}));
  player.StartOrStop();
  EXPECT_EQ(player.Advance(0.1, clock, shown), shown);
}

TEST(TimePlayer, GoesOnFromATimeStepThatWasChosenByHand) {
  const FrameClock clock = Quarters();
  TimePlayer player;
  player.StartOrStop();
  EXPECT_EQ(player.Advance(0.1, clock, 0), 0u);
  EXPECT_EQ(player.Advance(0.1, clock, 3), 3u);
  EXPECT_EQ(player.Advance(0.1, clock, 3), 3u);
  EXPECT_EQ(player.Advance(0.1, clock, 3), 0u);
}

TEST(TimePlayer, RunsAtAnotherSpeed) {
  const FrameClock clock = Quarters();
  TimePlayer player;
  player.speed = 4;
  player.StartOrStop();
  size_t shown = 0;
  std::vector<size_t> seen;
  for (int i = 0; i < 5; ++i) seen.push_back(shown = player.Advance(1.0 / 16, clock, shown));
  EXPECT_EQ(seen, (std::vector<size_t>{1, 2, 3, 0, 1}));
}

TEST(TimePlayer, PlayedOnceItStopsAtTheLastTimeStep) {
  const FrameClock clock = Quarters();
  TimePlayer player;
  player.loop = false;
  player.StartOrStop();
  size_t shown = 2;
  for (int i = 0; i < 20; ++i) shown = player.Advance(1.0 / 16, clock, shown);
  EXPECT_EQ(shown, 3u);
  EXPECT_FALSE(player.playing());
}

TEST(TimePlayer, ASlowFrameLeavesNoTimeStepOut) {
  const FrameClock clock = Quarters();
  TimePlayer player;
  player.StartOrStop();
  size_t shown = 0;
  for (int i = 0; i < 9; ++i) {
    const size_t next = player.Advance(60, clock, shown);
    EXPECT_LE((next + 4 - shown) % 4, 1u);
    shown = next;
  }
  EXPECT_EQ(shown, 3u);  // 9 steps of a tenth of a second
}

}  // namespace
}  // namespace dtr::viewer
