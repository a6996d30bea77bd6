// Cameras whose moments differ by a known time: what can be tried quickly. The rest is in
// free_running_full_test.cpp.
#include "calib/judge/free_running.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/error.h"
#include "tests/calib/judge/late_views.h"

namespace dtr::calib {
namespace {

using namespace testing;

TEST(FreeRunning, SynchronisedCamerasAreLeftAsTheyAre) {
  const auto cameras = RowOfCameras(2, 0.1);
  const auto views = LateViews(cameras, {0, 0}, 5);
  const FreeRunning free = SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
  EXPECT_EQ(free.passes, 1);
  EXPECT_FALSE(free.moved[1]);
  EXPECT_LT(std::abs(free.delays[1]->frames), 4.5 * free.delays[1]->sigma);
  const auto same = SolveRig(kBoard, InputsOf(cameras), views, kFrames);
  EXPECT_EQ(same.rms_px, free.solution.rms_px);
  EXPECT_EQ(same.covariance, free.solution.covariance);
}

TEST(FreeRunning, OutliersThatAreBroughtAreDroppedAndItsOwnAreNamed) {
  constexpr int kBrought = 3, kOwn = 10;
  const auto cameras = RowOfCameras(2, 0.1);
  auto views = LateViews(cameras, {0, 0.5}, 5);
  const auto is_spoiled = [](const RigView& v) { return v.camera == 1 && v.frame == 7; };
  const auto spoil = std::find_if(views.begin(), views.end(), is_spoiled);
  ASSERT_NE(spoil, views.end());
  spoil->seen.corners[kBrought].pixel.x() += 40;
  spoil->seen.corners[kOwn].pixel.y() -= 40;
  spoil->outliers = {kBrought};
  const FreeRunning free = SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
  const auto& solved = free.solution.rig.views;
  const auto view = std::find_if(solved.begin(), solved.end(), is_spoiled);
  ASSERT_NE(view, solved.end());
  EXPECT_THAT(view->outliers, ::testing::ElementsAre(kOwn));
  EXPECT_EQ(view->seen.corners.size(), static_cast<size_t>(kBoard.CornerCount()) - 1);
  EXPECT_EQ(free.solution.outliers, 1);
  EXPECT_NEAR(free.solution.sigma_px, kNoisePx, 0.05 * kNoisePx);  // so the delay was found, too
}

TEST(FreeRunning, ABoardThatTellsNoTimeIsRejected) {
  const auto cameras = RowOfCameras(2, 0.1);
  auto views = LateViews(cameras, {0, 0.5}, 5);
  // Every third frame alone: where the board was between them, nobody knows.
  std::erase_if(views, [](const RigView& view) { return view.frame % 3 != 0; });
  try {
    SolveFreeRunning(kBoard, InputsOf(cameras), views, kFrames);
    FAIL() << "not rejected";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                ::testing::HasSubstr("expected a board that moves through frames that follow"));
  }
}

}  // namespace
}  // namespace dtr::calib
