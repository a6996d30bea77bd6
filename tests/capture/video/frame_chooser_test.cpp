#include "capture/video/frame_chooser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/capture/video/moving_image.h"

namespace dtr::capture {
namespace {

using ::testing::ElementsAre;
using testing::GreyAt;
using ::testing::IsEmpty;
using testing::kWidth;

constexpr double kMotion = 0.1;  // 32 px of the 320

TimeStep At(int number, double x_px, double sharpness = 1, int wall = 1) {
  return {number, number / 25.0, {GreyAt(x_px, wall)}, [sharpness] { return sharpness; }};
}

std::vector<int> NumbersOf(const std::vector<ChosenFrame>& frames) {
  std::vector<int> numbers;
  for (const ChosenFrame& frame : frames) numbers.push_back(frame.number);
  return numbers;
}

TEST(FrameChooser, SpreadsFramesOverTheWayAndNotOverTime) {
  // 20 slow steps, then 10 of four times the length, then none.
  FrameChooser chooser(kMotion);
  std::vector<double> places;
  double place = 0;
  for (int i = 0; i < 60; ++i) {
    places.push_back(place);
    chooser.Add(At(i, place));
    place += i < 20 ? 4 : i < 30 ? 16 : 0;
  }
  const auto frames = chooser.Finish();
  ASSERT_GE(frames.size(), 5u);
  for (size_t i = 1; i < frames.size(); ++i) {
    const double way = (places[static_cast<size_t>(frames[i].number)] -
                        places[static_cast<size_t>(frames[i - 1].number)]) /
                       kWidth;
    EXPECT_GE(way, 0.75 * kMotion - 0.002);
    EXPECT_LE(way, 1.25 * kMotion + 0.002);
    EXPECT_NEAR(frames[i].moved, way, 0.003);  // a pixel of 320
  }
  EXPECT_GE(places[static_cast<size_t>(frames.back().number)], places.back() - 1.25 * 32);
}

TEST(FrameChooser, PassesOverBlurredFramesWhereASharpOneIsNear) {
  FrameChooser chooser(kMotion);
  for (int i = 0; i < 80; ++i) chooser.Add(At(i, 4.0 * i, i % 4 == 1 ? 1.0 : 0.1));
  auto frames = chooser.Finish();
  ASSERT_GE(frames.size(), 6u);
  frames.pop_back();  // the video may end before a sharp one comes
  for (const ChosenFrame& frame : frames) EXPECT_EQ(frame.number % 4, 1) << frame.number;
}

TEST(FrameChooser, AStillCameraGivesItsSharpestFrameOnly) {
  FrameChooser chooser(kMotion);
  for (int i = 0; i < 100; ++i) chooser.Add(At(i, 0.3 * (i % 3), i == 40 ? 2 : 1));
  EXPECT_THAT(NumbersOf(chooser.Finish()), ElementsAre(40));
}

TEST(FrameChooser, BeginsAnewAfterACutAndWhereThereWasNothingToSee) {
  FrameChooser chooser(kMotion);
  const Grid<std::uint8_t> black(kWidth, testing::kHeight);
  for (int i = 0; i < 5; ++i) chooser.Add({i, 0, {black}, [] { return 9.0; }});
  for (int i = 5; i < 10; ++i) chooser.Add(At(i, 0, i == 7 ? 2 : 1));
  for (int i = 10; i < 15; ++i) chooser.Add(At(i, 0, i == 12 ? 2 : 1, 2));
  const auto frames = chooser.Finish();
  EXPECT_THAT(NumbersOf(frames), ElementsAre(7, 12));
  EXPECT_EQ(frames[1].moved, 0);  // not known
}

TEST(FrameChooser, NothingToSeeGivesNothing) {
  FrameChooser chooser(kMotion);
  for (int i = 0; i < 5; ++i) {
    chooser.Add({i, 0, {Grid<std::uint8_t>(kWidth, testing::kHeight)}, [] { return 1.0; }});
  }
  EXPECT_THAT(chooser.Finish(), IsEmpty());
  EXPECT_THAT(FrameChooser(kMotion).Finish(), IsEmpty());
}

TEST(FrameChooser, CamerasOfARigAreTakenTogether) {
  // One camera looks along the way and sees half the motion; a third sees nothing at all.
  FrameChooser chooser(kMotion);
  const Grid<std::uint8_t> black(kWidth, testing::kHeight);
  for (int i = 0; i < 60; ++i) {
    chooser.Add({i, 0, {GreyAt(4.0 * i), GreyAt(2.0 * i, 2), black}, [] { return 1.0; }});
  }
  const auto frames = chooser.Finish();
  ASSERT_GE(frames.size(), 4u);
  for (size_t i = 1; i < frames.size(); ++i) {
    EXPECT_NEAR(frames[i].moved, 3.0 * (frames[i].number - frames[i - 1].number) / kWidth, 0.003);
  }
}

TEST(FrameChooser, RejectsMotionOutOfRange) {
  EXPECT_THROW(FrameChooser(0), std::invalid_argument);
  EXPECT_THROW(FrameChooser(1.5), std::invalid_argument);
}

TEST(Thinned, KeepsTheSharpestOfEqualParts) {
  std::vector<ChosenFrame> frames;
  for (int i = 0; i < 10; ++i) frames.push_back({i, 0, 0, i == 1 || i == 8 ? 2.0 : 1.0});
  EXPECT_THAT(NumbersOf(Thinned(frames, 2)), ElementsAre(1, 8));
  EXPECT_EQ(Thinned(frames, 0).size(), 10u);
  EXPECT_EQ(Thinned(frames, 10).size(), 10u);
  EXPECT_EQ(Thinned(frames, 7).size(), 7u);
}

}  // namespace
}  // namespace dtr::capture
